/* Version for any processor of the platform. */
#define WIDE_SUFFIX portable
#include "simd_functions.inc"
