"""A controller of your own, beside a shipped one in the same scenario.

Prints the share of the available force that both use while friction limits.
"""

import contactlib as cl


class HoldSlip(cl.SampledController):
    """PI control of the measured slip velocity, with a limited integral."""

    sample_time = 0.01

    def __init__(self, target=0.15, gain=4e4, rate=2e5):
        self.target, self.gain, self.rate, self.integral = target, gain, rate, 0.0

    def reset(self, measurement, torque):
        self.integral = torque

    def torque(self, measurement):
        error = self.target - (measurement.wheel_speed - measurement.vehicle_speed)
        self.integral += self.rate * error * self.sample_time
        self.integral = min(max(self.integral, 0.0), measurement.demand)
        return min(max(self.integral + self.gain * error, 0.0), measurement.demand)


scenario = cl.load_scenario("dry_wet_dry.toml")
for controller in ("threshold", HoldSlip()):
    found = cl.metrics(cl.run_scenario(scenario, controller), scenario.drivetrain)
    name = controller if isinstance(controller, str) else type(controller).__name__
    print(f"{name:10} {100 * found.limited_utilisation:.1f} %")
