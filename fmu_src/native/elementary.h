/* exp, log and sigmoid without branches, so that compilers turn loops over them into vector code, and small functions
   that laws use. Relative errors are those of libm: about 1e-16. */
#ifndef ELEMENTARY_H
#define ELEMENTARY_H

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef __FAST_MATH__
#error "these functions count on exact rounding: compile without -ffast-math"
#endif
#if FLT_EVAL_METHOD == 2 && !defined __STRICT_ANSI__
#error "the x87 unit rounds too late for these functions: compile with -std=c99 or for SSE2 (-msse2 -mfpmath=sse)"
#endif

#define LARGEST_EXPONENT 700.0

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }
static inline double clamp(double x, double low, double high) { return smaller(larger(x, low), high); }

static inline double from_bits(uint64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static inline uint64_t to_bits(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* exp(x) = scale * above / below for |x| <= 700: reduction by ln 2 in two parts and the rational function of Moshier's
   Cephes library (exp.c; Copyright 1984, 1987, 1989, 2000 by Stephen L. Moshier). */
typedef struct {
    double above, below, scale;
} Quotient;

static inline Quotient exp_quotient(double x) {
    /* 1.5 * 2^52 + 1023: adding it rounds to an integer, whose biased exponent is in the lowest bits */
    const double shift = 6755399441056767.0;
    const double shifted = x * 1.4426950408889634 + shift, n = shifted - shift;
    const double r = (x - n * 6.93145751953125e-1) - n * 1.42860682030941723212e-6, r2 = r * r;
    const double p =
        r * ((1.26177193074810590878e-4 * r2 + 3.02994407707441961300e-2) * r2 + 9.99999999999999999910e-1);
    const double q =
        ((3.00198505138664455042e-6 * r2 + 2.52448340349684104192e-3) * r2 + 2.27265548208155028766e-1) * r2
        + 2.00000000000000000005;
    const Quotient quotient = {q + p, q - p, from_bits(to_bits(shifted) << 52)};
    return quotient;
}

/* exp(x); where that is beyond 1e304 or below 1e-304, that. */
static inline double bounded_exp(double x) {
    const Quotient e = exp_quotient(clamp(x, -LARGEST_EXPONENT, LARGEST_EXPONENT));
    return e.scale * (e.above / e.below);
}

/* 1 / (1 + exp(y)) for |y| <= 700 */
static inline double sigmoid_of_negative(double y) {
    const Quotient e = exp_quotient(y);
    return e.below / (e.below + e.scale * e.above);
}

/* The logarithm of FreeBSD's msun (e_log.c) for positive normal numbers, changed: without branches.

   Copyright (C) 1993 by Sun Microsystems, Inc. All rights reserved.

   Developed at SunPro, a Sun Microsystems, Inc. business.
   Permission to use, copy, modify, and distribute this
   software is freely granted, provided that this notice
   is preserved. */
static inline double normal_log(double x) {
    const uint64_t root_half = 0x3fe6a09e00000000u, one = 0x3ff0000000000000u;
    const uint64_t moved = to_bits(x) + (one - root_half);
    const double k = from_bits((moved >> 52) | 0x4330000000000000u) - (4503599627370496.0 + 1023.0);
    const double f = from_bits((moved & 0x000fffffffffffffu) + root_half) - 1.0; /* 1 + f in [sqrt(1/2), sqrt(2)) */
    const double s = f / (2.0 + f), z = s * s, w = z * z, half = 0.5 * f * f;
    const double even = w * (3.999999999940941908e-1 + w * (2.222219843214978396e-1 + w * 1.531383769920937332e-1));
    const double odd = z * (6.666666666666735130e-1 + w * (2.857142874366239149e-1
                     + w * (1.818357216161805012e-1 + w * 1.479819860511658591e-1)));
    return k * 6.93147180369123816490e-1 - ((half - (s * (half + even + odd) + k * 1.90821492927058770002e-10)) - f);
}

static inline double whole_power(double base, int exponent) {
    double product = exponent & 1 ? base : 1.0;
    while (exponent >>= 1) {
        base *= base;
        if (exponent & 1) product *= base;
    }
    return product;
}

static inline double sign(double a) { return (double)((a > 0.0) - (a < 0.0)); }
static inline double modulo(double a, double b) { return a - b * floor(a / b); } /* signed as b, as in Python */

#endif
