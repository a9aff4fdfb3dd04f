/* The trained networks for 64-bit x86 with AVX2 and FMA (since 2013), whatever the compiler's options. */
#include "loss_networks.h"

#if HAS_AVX2_VARIANT
#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif

#define WIDE_VECTORS
#define LOSS_POWER loss_power_avx2
#include "loss_kernel.h"

#if defined __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#else
typedef int NothingHere; /* C has no empty files */
#endif
