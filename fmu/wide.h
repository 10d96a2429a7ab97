/* What is done to many at once, compiled for several widths of vectors.
 *
 * The same source makes each version (wide.inc), without contraction and without the system's
 * mathematics in a loop, so all give the same bits; the widest that the processor has is taken. */
#ifndef WIDE_H
#define WIDE_H

#include "creep_table.h"

#define WIDE_FUNCTIONS(suffix)                                                                   \
    void creep_table_evaluate_many_##suffix(const creep_table *table, size_t n, const double *x, \
                                            const double *k_hat, size_t k_stride, double *ratio, \
                                            double *slope);

WIDE_FUNCTIONS(portable)
WIDE_FUNCTIONS(avx2)
WIDE_FUNCTIONS(avx512)

#endif
