/* Wheels for x86-64 with AVX-512. */
#include "simd_dispatch.h"
#if defined(__x86_64__) && defined(__GNUC__)
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl"))), \
                             apply_to = function)
#else
#pragma GCC target("avx512f,avx512dq,avx512vl")
#endif
#define WIDE_SUFFIX avx512
#include "simd_wheels.h"
#if defined(__clang__)
#pragma clang attribute pop
#endif
#endif
