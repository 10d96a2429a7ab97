"""Model-predictive slip control over a wet patch: CasADi on the exported wheelset.

Every 10 ms an extended Kalman filter estimates the rail's friction from the measured speeds, and
one step of sequential quadratic programming plans the torque of the next 0.1 s: that which holds
the saturation creepage, at most the demand. Prints the share of the available force that each
controller uses. docs/howto/optimal_control.md explains it.
"""

import casadi as ca
import numpy as np
from scipy.linalg import expm

import contactlib as cl

scenario = cl.load_scenario("dry_wet_dry.toml")
train, sensors, step, nodes = scenario.drivetrain, scenario.sensors, 0.01, 10

# The wheelset's equations, with derivatives from the FMU's Jacobian alone.
model = cl.Model(name="wheelset", source="example", wheelset=train.wheelset.without_memory())
fmu = cl.export_fmu(model, "wheelset.fmu", kind="wheelset", booleans=False)
dae = ca.DaeBuilder("wheelset", str(fmu))
by_jacobian = {"enable_forward": False, "enable_reverse": False}
wheelset = dae.create("wheelset", ["x", "u"], ["ode", "y"], by_jacobian)

# Further states: motor torque, friction scale, relative error of the measured wheel speed.
state, command = ca.MX.sym("state", 5), ca.MX.sym("command")
given = {name: dae.start(name) for name in dae.u()}
given |= {"drive_torque": state[2], "friction_scale": state[3]}
ode, outputs = wheelset(ca.vertcat(state[:2], 1.0), ca.vertcat(*given.values()))
rates = ca.vertcat(ode[:2], (command - state[2]) / train.motor.lag, 0.0, 0.0)
creepage = outputs[dae.y().index("normalized_creepage")]
vehicle = ca.Function("vehicle", [state, command], [rates, creepage])
linear = ca.Function("linear", [state, command], [rates, ca.jacobian(rates, state)])

# At each node of the plan: the state, the command until then and the normalized creepage.
plan, start = ca.MX.sym("plan", 7, nodes), ca.MX.sym("start", 6)
equations, before = [], start
for node in ca.horzsplit(plan):
    rate, slip = vehicle(node[:5], node[5])
    euler = node[:5] - before[:5] - step * rate  # implicit, as the contact is stiff
    equations += [euler / [1.0, 1.0, 1e4, 1.0, 1.0], node[6] - slip]
    before = node
change = ca.diff(ca.horzcat(start[5], plan[5, :]), 1, 1) / 1e4
cost = ca.sumsqr(plan[6, :] - 1.0) + ca.sumsqr(change)
problem = {"x": ca.vec(plan), "p": start, "f": cost, "g": ca.vertcat(*equations)}
factor, multipliers = ca.MX.sym("factor"), ca.MX.sym("multipliers", problem["g"].numel())
convex = factor * ca.hessian(cost, problem["x"])[0]  # without the curvature of the equations
curvature = ca.Function("curvature", [problem["x"], start, factor, multipliers], [convex])
silent = {"print_header": False, "print_iteration": False, "print_status": False}
one_step = {"max_iter": 1, "max_iter_ls": 0, "hess_lag": curvature, "print_time": False}
quadratic = {"qpsol": "qrqp", "qpsol_options": {"print_iter": False, "print_header": False}}
solver = ca.nlpsol("solver", "sqpmethod", problem, silent | one_step | quadratic)


class Predictive(cl.SampledController):
    """Kalman filter, and a plan from which the next torque is taken."""

    sample_time = step
    noise = np.diag([sensors.wheel_speed_noise, sensors.vehicle_speed_noise]) ** 2
    drift = np.diag([0.005, 1e-4, 1.0, 0.006, 0.0]) ** 2  # in a step, of what the model lacks

    def reset(self, measurement, torque):
        omega = measurement.wheel_speed / train.wheelset.radius
        self.state = np.array([omega, measurement.vehicle_speed, torque, 1.0, 0.0])
        self.variance = np.diag([0.1, 0.1, 1.0, 0.3, 0.01]) ** 2
        self.plan = np.tile([*self.state, torque, 0.0], nodes)

    def torque(self, measurement):
        # The sensors' delay is a step: correct the state of then, and predict that of now.
        omega, speed, error = self.state[[0, 1, 4]]
        radius = train.wheelset.radius
        sensed = np.array([[radius, 0.0, 0.0, 0.0, speed], [0.0, 1.0, 0.0, 0.0, 0.0]])
        both = self.variance @ sensed.T
        gain = both @ np.linalg.inv(sensed @ both + self.noise)
        wheel_surprise = measurement.wheel_speed - radius * omega - error * speed
        corrected = self.state + gain @ [wheel_surprise, measurement.vehicle_speed - speed]
        corrected[3] = np.clip(corrected[3], 0.1, 2.0)
        rate, jacobian = (matrix.full() for matrix in linear(corrected, measurement.torque))
        flow = expm(step * np.block([[jacobian, rate], [np.zeros((1, 6))]]))
        self.state = corrected + flow[:5, 5]
        self.variance = flow[:5, :5] @ (self.variance - gain @ both.T) @ flow[:5, :5].T + self.drift
        low = np.tile([*[-np.inf] * 5, 0.0, -np.inf], nodes)
        high = np.tile([*[np.inf] * 5, measurement.demand, np.inf], nodes)
        start = np.append(self.state, measurement.torque)
        self.plan = solver(x0=self.plan, p=start, lbx=low, ubx=high, lbg=0.0, ubg=0.0)["x"].full()
        return float(np.clip(self.plan[5, 0], 0.0, measurement.demand))


for controller in ("threshold", "creep_pi", "slope_seeking", Predictive()):
    found = cl.metrics(cl.run_scenario(scenario, controller), train)
    name = controller if isinstance(controller, str) else type(controller).__name__
    shares = f"{100 * found.limited_utilisation:.1f} % while friction limits"
    print(f"{name:14} {shares}, {100 * found.utilisation:.1f} % in all")
