/* A Simulink S-function of the force over each step, written by contactlib @version@ beside
 * contactlib.c: mex contactlib_sfun.c contactlib.c
 *
 * Parameters: the sample time [s]; radius^2/inertia + 1/mass of what the force moves [1/kg], which is
 * @inverse_mass@ here@assumed@. Inputs: omega [rad/s], speed [m/s], normal load
 * [N], factor on friction [1]. Outputs: creep force [N] and wheel torque [N.m] over the step that
 * begins, creepage [1]. */
#define S_FUNCTION_NAME contactlib_sfun
#define S_FUNCTION_LEVEL 2

#include <stdlib.h>

#include "contactlib.h"
#include "simstruc.h"

enum { PARAMETERS = 2, INPUTS = 4, OUTPUTS = 3 };

static double sample_time(SimStruct *S) { return mxGetScalar(ssGetSFcnParam(S, 0)); }

static void mdlInitializeSizes(SimStruct *S) {
    ssSetNumSFcnParams(S, PARAMETERS);
    if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) return; /* Simulink reports it */
    if (!ssSetNumInputPorts(S, 1) || !ssSetNumOutputPorts(S, 1)) return;
    ssSetInputPortWidth(S, 0, INPUTS);
    ssSetInputPortRequiredContiguous(S, 0, 1);
    ssSetInputPortDirectFeedThrough(S, 0, 1);
    ssSetOutputPortWidth(S, 0, OUTPUTS);
    ssSetNumSampleTimes(S, 1);
    ssSetNumPWork(S, 1);
}

static void mdlInitializeSampleTimes(SimStruct *S) {
    ssSetSampleTime(S, 0, sample_time(S));
    ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_START
static void mdlStart(SimStruct *S) {
    contactlib_element *wheel = (contactlib_element *)malloc(sizeof *wheel);
    ssSetPWorkValue(S, 0, wheel);
    if (wheel == NULL) {
        ssSetErrorStatus(S, "contactlib: no memory");
        return;
    }
    contactlib_start(wheel);
    wheel->effective_inverse_mass = mxGetScalar(ssGetSFcnParam(S, 1));
}

static void mdlOutputs(SimStruct *S, int_T tid) {
    (void)tid;
    contactlib_element *wheel = (contactlib_element *)ssGetPWorkValue(S, 0);
    const real_T *u = (const real_T *)ssGetInputPortSignal(S, 0);
    real_T *y = ssGetOutputPortRealSignal(S, 0);
    wheel->input.omega = u[0];
    wheel->input.speed = u[1];
    wheel->input.normal_load = u[2];
    wheel->input.friction_scale = u[3];
    const char *error = contactlib_step(wheel, sample_time(S), CONTACTLIB_TOLERANCE);
    if (error != NULL) {
        ssSetErrorStatus(S, error); /* a constant text, as Simulink demands */
        return;
    }
    y[0] = wheel->output.creep_force;
    y[1] = wheel->output.wheel_torque;
    y[2] = wheel->output.creepage;
}

static void mdlTerminate(SimStruct *S) { free(ssGetPWorkValue(S, 0)); }

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
