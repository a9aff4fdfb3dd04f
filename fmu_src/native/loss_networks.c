/* The trained networks: clip, features, two sigmoid layers, a linear part around them, exp, ramps to zero.

   Every network is cut into blocks that share no hidden unit, and evaluated once per use, so no product with a zero is
   made; a use that follows one of the same network with the same features, such as the second of two alike bearings at
   the same temperature, takes over its results. The hidden units of all other blocks stand side by side: one loop
   computes all their sigmoids.

   The kernel is written once, in loops that compilers turn into vector code, and compiled into two functions: for any
   processor, and where HAS_AVX2_VARIANT for 64-bit x86 with AVX2 and FMA (since 2013). */
#include "loss_networks.h"
#include "elementary.h"
#include "model_data.h"

#define LN_10 2.3025850929940459

#if defined __GNUC__
#define INLINED static inline __attribute__((always_inline))
#else
#define INLINED static inline
#endif

/* y = b + x W for `width` columns (a constant where it is called), W by rows: their sums stay in registers. */
INLINED void columns(const double *RESTRICT w, const double *RESTRICT b, const double *RESTRICT x, int n_in,
                     double *RESTRICT y, const int width) {
    double sum[LARGEST_WIDTH];
    for (int k = 0; k < width; k++) sum[k] = b[k];
    for (int i = 0; i < n_in; i += 2)
        for (int k = 0; k < width; k++) sum[k] += w[width * i + k] * x[i] + w[width * (i + 1) + k] * x[i + 1];
    for (int k = 0; k < width; k++) y[k] = sum[k];
}

/* y = b + x W, W in tiles of 16 columns and one of the rest, each by rows; n_in is even, n_out a multiple of four. */
INLINED void dense(const double *w, const double *b, const double *x, int n_in, double *y, int n_out) {
    int done = 0;
    for (; n_out - done >= LARGEST_WIDTH; done += LARGEST_WIDTH)
        columns(w + done * n_in, b + done, x, n_in, y + done, LARGEST_WIDTH);
    if (n_out - done == 12) columns(w + done * n_in, b + done, x, n_in, y + done, 12);
    if (n_out - done == 8) columns(w + done * n_in, b + done, x, n_in, y + done, 8);
    if (n_out - done == 4) columns(w + done * n_in, b + done, x, n_in, y + done, 4);
}

/* The sum of two products of rows, whose lengths are multiples of four. */
INLINED double products(const double *a, const double *b, int count, const double *c, const double *d, int more) {
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    for (int i = 0; i < count; i += 4)
        for (int k = 0; k < 4; k++) sum[k] += a[i + k] * b[i + k];
    for (int i = 0; i < more; i += 4)
        for (int k = 0; k < 4; k++) sum[k] += c[i + k] * d[i + k];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* Only a network with absurd weights has sums that exp cannot take. */
INLINED void sigmoids(double *y, int count) {
#if SUMS_ARE_LARGE
    for (int i = 0; i < count; i++) y[i] = clamp(y[i], -LARGEST_EXPONENT, LARGEST_EXPONENT);
#endif
    for (int i = 0; i < count; i++) y[i] = sigmoid_of_negative(y[i]);
}

/* Features of all uses at an operating point; three zeros follow them, as rows of weights end with zeros. */
INLINED void find_features(double speed, double torque, const double *T, double *features) {
    double point[2 + N_LOSS_NODES], pool[2 * N_ROWS + AT_LEAST_ONE(N_VISCOSITIES)];
    double *const logs = pool + N_ROWS, *const viscosities = logs + N_ROWS;
    point[0] = clamp(speed, SPEED_LOW, SPEED_HIGH);
    point[1] = clamp(torque, 0.0, TORQUE_HIGH); /* each network knows its own lowest load */
    for (int i = 0; i < N_LOSS_NODES; i++) point[2 + i] = clamp(T[i], T_LOW, T_HIGH);
    for (int i = 0; i < N_ROWS; i++) pool[i] = clamp(ROW_FACTOR[i] * point[ROW_FROM[i]], ROW_LOWER[i], ROW_UPPER[i]);
    for (int i = 0; i < N_ROWS; i++) logs[i] = normal_log(pool[i] + ROW_SHIFT[i]);
    for (int i = 0; i < N_VISCOSITIES; i++) viscosities[i] = VISCOSITY_M[i] - VISCOSITY_N[i] * logs[VISCOSITY_FROM[i]];
    for (int i = 0; i < N_VISCOSITIES; i++) viscosities[i] = LN_10 * bounded_exp(viscosities[i]);
    for (int i = 0; i < N_FEATURES; i++) features[i] = pool[FEATURE_FROM[i]];
    for (int i = N_FEATURES; i < N_FEATURES + 3; i++) features[i] = 0.0;
}

INLINED void find_power(double speed, double torque, const double *RESTRICT T, double *RESTRICT power) {
    double features[N_FEATURES + 3], first[N_FIRST], second[N_SECOND], raw[N_NETS] = {0.0}, net[N_NETS];
    const double n = fabs(speed), moment = fabs(torque);
    /* 1 within the range of training, beyond it in proportion. */
    const double speed_share = smaller(n / SPEED_LOW, 1.0) * larger(n / SPEED_HIGH, 1.0);
    const double torque_share = smaller(moment / TORQUE_LOW, 1.0) * larger(moment / TORQUE_HIGH, 1.0);
    char repeated[N_BLOCKS];
    int n_first = 0, n_second = 0, from_first = 0, from_second = 0;
    find_features(n, moment, T, features);
    for (int i = 0; i < N_BLOCKS; i++) {
        const Block *const block = BLOCKS + i, *const before = BLOCKS + (i > 0 ? i - 1 : 0);
        const double *const x = features + block->features;
        repeated[i] = i > 0 && block->w_1 == before->w_1
            && !memcmp(x, features + before->features, (size_t)block->n_features * sizeof *x);
        if (repeated[i]) continue;
        dense(block->w_1, block->b_1, x, block->n_features, first + n_first, block->n_first);
        n_first += block->n_first;
    }
    sigmoids(first, n_first);
    for (int i = 0; i < N_BLOCKS; i++) {
        const Block *const block = BLOCKS + i;
        if (repeated[i]) continue;
        dense(block->w_2, block->b_2, first + from_first, block->n_first, second + n_second, block->n_second);
        from_first += block->n_first;
        n_second += block->n_second;
    }
    sigmoids(second, n_second);
    for (int i = 0; i < N_BLOCKS; i++) {
        const Block *const block = BLOCKS + i;
        for (int k = 0; k < block->n_nets; k++)
            raw[block->nets + k] = repeated[i]
                ? raw[block->nets - block->n_nets + k]
                : block->b_3[k] + products(block->w_3 + k * block->n_second, second + from_second, block->n_second,
                                           block->passed + k * block->n_passed, features + block->features,
                                           block->n_passed);
        if (!repeated[i]) from_second += block->n_second;
    }
    for (int i = 0; i < N_NETS; i++) net[i] = bounded_exp(raw[i]);
    for (int i = 0; i < N_COMPONENTS; i++) {
        const int from = COMPONENT_FROM[i];
        const double loss = COMPONENT_IS_LOG[i] ? net[from] : larger(raw[from], 0.0);
        power[i] = loss * speed_share * (COMPONENT_DRIVEN[i] ? torque_share : 1.0);
    }
}

void loss_power_portable(double speed, double torque, const double *RESTRICT T, double *RESTRICT power) {
    find_power(speed, torque, T, power);
}

#if HAS_AVX2_VARIANT
#include <cpuid.h>

__attribute__((target("avx2,fma"))) void loss_power_avx2(double speed, double torque, const double *RESTRICT T,
                                                         double *RESTRICT power) {
    find_power(speed, torque, T, power);
}

/* True if the processor has AVX2 and FMA, and the operating system saves their registers. */
static int has_avx2(void) {
    unsigned a, b, c, d, saved, high;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_FMA) || !(c & bit_OSXSAVE)) return 0;
    __asm__ volatile("xgetbv" : "=a"(saved), "=d"(high) : "c"(0));
    return (saved & 6) == 6 && __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & bit_AVX2) != 0;
}

LossPower *loss_power_here(void) { return has_avx2() ? loss_power_avx2 : loss_power_portable; }
#else
LossPower *loss_power_here(void) { return loss_power_portable; }
#endif

double loss_domain_distance(double speed, double torque, const double *T) {
    const double fast = (fabs(speed) - SPEED_HIGH) / (SPEED_HIGH - SPEED_LOW);
    const double heavy = (fabs(torque) - TORQUE_HIGH) / (TORQUE_HIGH - TORQUE_LOW);
    double off = 0.0;
    for (int i = 0; i < N_LOSS_NODES; i++) off = larger(off, larger(T[i] - T_HIGH, T_LOW - T[i]));
    return larger(larger(fast, heavy), off / (T_HIGH - T_LOW));
}
