// The kernel's structs of doubles, written by build.py from the C headers: do not edit.

/** force_element_parameters of the kernel. */
export interface ForceElementParameters {
  /** rolling radius [m] */
  radius: number;
  /** f_s [1] */
  static_friction: number;
  /** f_d [1] */
  kinetic_friction: number;
  /** Delta [m] */
  weakening_length: number;
  /** third-body layer: initial slope is this times the elastic one [1] */
  slope_reduction: number;
  /** a at nominal load [m] */
  semi_width: number;
  /** p0 at nominal load [Pa] */
  peak_pressure: number;
  /** E* [Pa] */
  contact_modulus: number;
  /** P [N] */
  nominal_load: number;
  /** a and p0 grow like load to this power [1] */
  load_exponent: number;
  /** below it the creepage's reference speed is regularised [m/s] */
  minimum_speed: number;
  /** A of the factor (1 - A) exp(-B w) + A on friction [1] */
  slip_rate_residual: number;
  /** B, w being the slip speed [s/m] */
  slip_rate_decay: number;
  /** sigma [m]; 0 if the force follows the creepage at once */
  relaxation_length: number;
}

/** force_element_input of the kernel. */
export interface ForceElementInput {
  /** angular velocity [rad/s] */
  omega: number;
  /** forward velocity [m/s] */
  speed: number;
  /** [N] */
  normal_load: number;
  /** multiplies f_s and f_d [1] */
  friction_scale: number;
  /** state of the relaxation, if there is one [1] */
  relaxed_creepage: number;
}

/** force_element_output of the kernel. */
export interface ForceElementOutput {
  /** on the wheel, forward [N] */
  creep_force: number;
  /** of the creep force on the wheel [N.m] */
  wheel_torque: number;
  /** zeta [1] */
  creepage: number;
  /** x = zeta/zeta0, of the relaxed creepage if relaxed [1] */
  normalized_creepage: number;
  /** creep force over normal load [1] */
  traction_coefficient: number;
  /** d(creep force)/d(slip velocity) at fixed speed [N.s/m] */
  force_gradient: number;
  /** at this load, friction and slip speed [1] */
  k_hat: number;
  /** zeta0 at this load, friction and slip speed [1] */
  saturation_creepage: number;
  /** weakening zone over contact semi-width, likewise [1] */
  process_zone_ratio: number;
  /** d(relaxed creepage)/dt [1/s] */
  relaxation_rate: number;
  /** 1 if the force falls with creepage at fixed speed */
  falling_branch: number;
  /** 1 if |speed| < minimum_speed and that matters */
  speed_regularized: number;
  /** 1 if k_hat is held at the table's largest value */
  k_hat_limited: number;
  /** 1 if the force is held at f_s times the load */
  force_limited: number;
  /** each truth value above is 1 where its margin is > 0 [1] */
  falling_margin: number;
  /** [m/s] */
  speed_margin: number;
  /** [1] */
  k_hat_margin: number;
  /** in friction coefficients [1] */
  force_margin: number;
  /** partial derivatives of the creep force [N.s] */
  force_by_omega: number;
  /** [N.s/m] */
  force_by_speed: number;
  /** [1] */
  force_by_load: number;
  /** [N] */
  force_by_relaxed: number;
  /** partial derivatives of the creepage [s] */
  creepage_by_omega: number;
  /** [s/m] */
  creepage_by_speed: number;
  /** partial derivatives of the relaxation rate [1] */
  rate_by_omega: number;
  /** [1/m] */
  rate_by_speed: number;
  /** [1/s] */
  rate_by_relaxed: number;
}

/** contact_scales of the kernel. */
export interface ContactScales {
  /** zeta0 [1] */
  saturation_creepage: number;
  /** [1] */
  k_hat: number;
  /** [1] */
  process_zone_ratio: number;
}

/** wheelset_parameters of the kernel. */
export interface WheelsetParameters {
  /** r [m] */
  radius: number;
  /** J, with the drive's inertia [kg.m2] */
  inertia: number;
  /** 1/M [1/kg]; 0 holds the speed, as a roller rig does */
  inverse_mass: number;
  /** b, drive torque lost per angular velocity [N.m.s/rad] */
  damping: number;
  /** Davis: A [N] */
  constant_resistance: number;
  /** B [N.s/m] */
  linear_resistance: number;
  /** C [N.s2/m2] */
  quadratic_resistance: number;
  /** g times the grade, positive uphill [m/s2] */
  grade_acceleration: number;
  /** the constant resistance fades out below it [m/s] */
  minimum_speed: number;
}

/** wheelset_rates of the kernel. */
export interface WheelsetRates {
  /** d(omega)/dt [rad/s2] */
  omega_rate: number;
  /** d(speed)/dt [m/s2] */
  speed_rate: number;
  /** F(V) with the grade, without the input's force [N] */
  resistance: number;
  /** dF/dV [N.s/m] */
  resistance_slope: number;
  /** rates by (omega, speed) */
  jacobian: number[];
}

/** drivetrain_parameters of the kernel. */
export interface DrivetrainParameters {
  body: WheelsetParameters;
  /** k, between the wheels [N.m/rad]; 0 if the axle is rigid */
  axle_stiffness: number;
  /** d [N.m.s/rad] */
  axle_damping: number;
  /** part of the drive torque that acts on the left wheel [1] */
  drive_share: number;
  /** time constant of the drive torque [s]; 0 if it follows at once */
  motor_lag: number;
}

/** drivetrain_state of the kernel. */
export interface DrivetrainState {
  /** [m/s] */
  speed: number;
  /** [rad/s] */
  omega_left: number;
  /** that of the left wheel if the axle is rigid [rad/s] */
  omega_right: number;
  /** angle of the left wheel ahead of the right one [rad] */
  twist: number;
  /** relaxed creepages, if the contact has a relaxation length [1] */
  relaxed_left: number;
  /** [1] */
  relaxed_right: number;
  /** at the axle [N.m] */
  drive_torque: number;
  /** [m] */
  distance: number;
  /** of the drive torque [J] */
  drive_work: number;
  /** of the creep forces on the slip velocities [J] */
  creep_work: number;
  /** of the resistances; at held speed, what the rig takes [J] */
  resistance_work: number;
  /** of the drive's and the axle's damping [J] */
  loss_work: number;
}

/** drivetrain_input of the kernel. */
export interface DrivetrainInput {
  /** [N.m] */
  commanded_torque: number;
  /** [N] */
  resistance_force: number;
  /** of a speed that is held: inverse_mass is zero [m/s2] */
  acceleration: number;
  /** of the wheel [N] */
  load_left: number;
  /** [N] */
  load_right: number;
  /** multiplies f_s and f_d [1] */
  friction_left: number;
  /** [1] */
  friction_right: number;
}

/** drivetrain_output of the kernel. */
export interface DrivetrainOutput {
  /** [N] */
  creep_force_left: number;
  /** [N] */
  creep_force_right: number;
  /** [1] */
  creepage_left: number;
  /** [1] */
  creepage_right: number;
  /** 1 if the force falls with creepage at fixed speed */
  falling_left: number;
  /** [1] */
  falling_right: number;
  /** [N.m] */
  drive_torque: number;
  /** what the axle carries from left to right, with its damping [N.m] */
  axle_torque: number;
  /** [m/s2] */
  speed_rate: number;
  /** kinetic, and of the axle's twist [J] */
  stored_energy: number;
}

/** Names of each struct's doubles in their order. A struct within one stands before them, an array
 * behind them. */
export const FIELDS = {
  ForceElementParameters: [
    "radius",
    "static_friction",
    "kinetic_friction",
    "weakening_length",
    "slope_reduction",
    "semi_width",
    "peak_pressure",
    "contact_modulus",
    "nominal_load",
    "load_exponent",
    "minimum_speed",
    "slip_rate_residual",
    "slip_rate_decay",
    "relaxation_length",
  ],
  ForceElementInput: [
    "omega",
    "speed",
    "normal_load",
    "friction_scale",
    "relaxed_creepage",
  ],
  ForceElementOutput: [
    "creep_force",
    "wheel_torque",
    "creepage",
    "normalized_creepage",
    "traction_coefficient",
    "force_gradient",
    "k_hat",
    "saturation_creepage",
    "process_zone_ratio",
    "relaxation_rate",
    "falling_branch",
    "speed_regularized",
    "k_hat_limited",
    "force_limited",
    "falling_margin",
    "speed_margin",
    "k_hat_margin",
    "force_margin",
    "force_by_omega",
    "force_by_speed",
    "force_by_load",
    "force_by_relaxed",
    "creepage_by_omega",
    "creepage_by_speed",
    "rate_by_omega",
    "rate_by_speed",
    "rate_by_relaxed",
  ],
  ContactScales: [
    "saturation_creepage",
    "k_hat",
    "process_zone_ratio",
  ],
  WheelsetParameters: [
    "radius",
    "inertia",
    "inverse_mass",
    "damping",
    "constant_resistance",
    "linear_resistance",
    "quadratic_resistance",
    "grade_acceleration",
    "minimum_speed",
  ],
  WheelsetRates: [
    "omega_rate",
    "speed_rate",
    "resistance",
    "resistance_slope",
  ],
  DrivetrainParameters: [
    "axle_stiffness",
    "axle_damping",
    "drive_share",
    "motor_lag",
  ],
  DrivetrainState: [
    "speed",
    "omega_left",
    "omega_right",
    "twist",
    "relaxed_left",
    "relaxed_right",
    "drive_torque",
    "distance",
    "drive_work",
    "creep_work",
    "resistance_work",
    "loss_work",
  ],
  DrivetrainInput: [
    "commanded_torque",
    "resistance_force",
    "acceleration",
    "load_left",
    "load_right",
    "friction_left",
    "friction_right",
  ],
  DrivetrainOutput: [
    "creep_force_left",
    "creep_force_right",
    "creepage_left",
    "creepage_right",
    "falling_left",
    "falling_right",
    "drive_torque",
    "axle_torque",
    "speed_rate",
    "stored_energy",
  ],
} as const;
