#include "plane_law.h"

#include "plane_formula.h"

void plane_evaluate(const creep_table *table, const plane_shape *shape, const double creepage[3],
                    double k_hat, plane_value *value) {
    plane_at(table, shape, creepage, k_hat, value);
}
