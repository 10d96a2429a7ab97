/* Time integration of a few stiff differential equations, stable at any step.
 *
 * Rodas3: a linearly implicit Rosenbrock method of four stages and third order, L-stable and
 * stiffly accurate, with an embedded second-order solution that controls the substeps. It needs
 * the exact Jacobian and no iteration.
 *
 * A. Sandu, J. G. Verwer, J. G. Blom, E. J. Spee, G. R. Carmichael & F. A. Potra, "Benchmarking
 * stiff ODE solvers for atmospheric chemistry problems II: Rosenbrock solvers", Atmospheric
 * Environment 31 (1997) 3459-3472. */
#ifndef ROSENBROCK_H
#define ROSENBROCK_H

enum { MOST_STATES = 7, MOST_ROWS = 12 };

/* Equations y' = f(y). Of its rows the first are states; the others are integrals along the way,
 * such as works, on which nothing depends. */
typedef struct {
    int states, rows;
    void *model;
    /* Rates of all rows, and unless it is null their derivatives by the states. */
    void (*rates)(void *model, const double *y, double *f, double (*jacobian)[MOST_STATES]);
    /* Size of an error of y, as a part of what is called one hundred per cent. */
    double (*error_size)(const void *model, const double *y, const double *error);
} equations;

/* Step y on, with an error of each substep up to the tolerance. substep is the length to try
 * first, 0 if none is known, and then the one to go on with. Returns NULL, or why the step failed;
 * y is then as it was. */
const char *rosenbrock_advance(const equations *problem, double *y, double step, double tolerance,
                               double *substep);

#endif
