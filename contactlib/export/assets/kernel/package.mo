// @text@
// Written by contactlib @version@ beside contactlib.c. The folder must have the package's name; in it
//     cc -O2 -ffp-contract=off -fno-math-errno -fno-trapping-math -fPIC -c contactlib.c
//     ar rcs libcontactlib.a contactlib.o
// makes the library that the function below is linked to.
within ;
package Contactlib "Creep force between a wheel and its rail"
  connector RealInput = input Real;
  connector RealOutput = output Real;

  pure function creepForce "Steady force at given velocities and load"
    input Real omega(unit="rad/s") "Angular velocity of the wheel";
    input Real speed(unit="m/s") "Forward velocity";
    input Real normal_load(unit="N") "Load of the wheel; a negative one counts as none";
    input Real friction_scale(unit="1") = 1.0 "Factor on friction";
    input Real lateral_velocity(unit="m/s") = 0.0 "Of the wheel's surface, to the left";
    input Real spin_velocity(unit="rad/s") = 0.0 "Likewise, about the vertical axis upwards";
    output Real creep_force(unit="N") "On the wheel, forward";
    output Real wheel_torque(unit="N.m") "Of the creep force on the wheel";
    output Real lateral_force(unit="N") "On the wheel, to the left";
    output Real spin_moment(unit="N.m") "On the wheel, about the vertical axis upwards";
    output Real creepage(unit="1") "Positive in traction";
  external "C" contactlib_modelica_force(omega, speed, normal_load, friction_scale,
      lateral_velocity, spin_velocity, creep_force, wheel_torque, lateral_force, spin_moment,
      creepage)
    annotation(Include = "#include \"contactlib_modelica.h\"",
      IncludeDirectory = "modelica://Contactlib", Library = "contactlib",
      LibraryDirectory = "modelica://Contactlib");
  end creepForce;

  block CreepForce "The force as a block without a state"
    RealInput omega(unit="rad/s");
    RealInput speed(unit="m/s");
    RealInput normal_load(unit="N");
    RealInput friction_scale(unit="1");
    RealInput lateral_velocity(unit="m/s");
    RealInput spin_velocity(unit="rad/s");
    RealOutput creep_force(unit="N");
    RealOutput wheel_torque(unit="N.m");
    RealOutput lateral_force(unit="N");
    RealOutput spin_moment(unit="N.m");
    RealOutput creepage(unit="1");
  equation
    (creep_force, wheel_torque, lateral_force, spin_moment, creepage) = creepForce(omega, speed,
      normal_load, friction_scale, lateral_velocity, spin_velocity);
  end CreepForce;

  model SlipAway "A wheel at a held speed under a torque that grows until it slips away"
    parameter Real speed(unit="m/s") = @speed@;
    parameter Real inertia(unit="kg.m2") = @inertia@
      "With which the slip follows the force as in the model@assumed@";
    parameter Real torque_rate(unit="N.m/s") = @torque_rate@;
    CreepForce contact;
    Real omega(start = @omega@, fixed = true, unit="rad/s");
  equation
    contact.omega = omega;
    contact.speed = speed;
    contact.normal_load = @normal_load@;
    contact.friction_scale = 1.0;
    contact.lateral_velocity = 0.0;
    contact.spin_velocity = 0.0;
    inertia * der(omega) = torque_rate * time + contact.wheel_torque;
  end SlipAway;
end Contactlib;
