/* Force in the plane of a rolling ellipse on a half-space: along and across rolling, and the moment
 * of spin, from creepage along and across and spin. */
#ifndef PLANE_LAW_H
#define PLANE_LAW_H

#include "creep_table.h"
#include "export.h"

/* What an ellipse of one shape adds to the law of longitudinal creepage. */
typedef struct {
    double stiffness_ratio;     /* c22/c11: stiffness across over that along rolling [1] */
    double softening_x;         /* see half_space.h [1] */
    double softening_y;         /* [1] */
    const double *coefficients; /* sets of PLANE_COEFFICIENTS numbers; NULL: no spin */
    double share[4];            /* of each of up to 4 sets in a row */
    int sets;
} plane_shape;

/* The spline has cubic cells of equal size over -1 <= u <= 1 in each of three directions. */
#define PLANE_CELLS 16
#define PLANE_COEFFICIENTS ((PLANE_CELLS / 2 + 3) * (PLANE_CELLS + 3) * (PLANE_CELLS / 2 + 3) * 3)

typedef struct {
    double force[3];          /* along, across [f_d N]; moment [f_d N sqrt(a b)] */
    double by_creepage[3][3]; /* rows: force; columns: creepage */
    double by_log_k[3];       /* k_hat d(force)/d(k_hat) */
} plane_value;

/* The force at normalized creepages along and across rolling and a normalized spin, of the sign of
 * the force. Their unit is that of the force in full stick: 3 pi/4 of the first two is the force,
 * and so is that of spin but for its own scale (plane_scales). k_hat is at most the table's. */
CONTACTLIB_API void plane_evaluate(const creep_table *table, const plane_shape *shape,
                                   const double creepage[3], double k_hat, plane_value *value);

#endif
