/* Version for x86-64 with AVX2. */
#include "simd_dispatch.h"
#if defined(__x86_64__) && defined(__GNUC__)
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC target("avx2")
#endif
#define WIDE_SUFFIX avx2
#include "simd_functions.inc"
#if defined(__clang__)
#pragma clang attribute pop
#endif
#endif
