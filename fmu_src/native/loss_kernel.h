/* The networks for one kind of processor, included by loss_networks.c and loss_networks_avx2.c: clip, features, two
   sigmoid layers, a linear part around them, exp, ramps to zero.

   Every network is cut into blocks that share no hidden unit, and evaluated once per use, so no product with a zero is
   made. The hidden units of all blocks and uses stand side by side: one loop computes all their sigmoids. */
#include "elementary.h"
#include "loss_networks.h"
#include "model_data.h"

#define LN_10 2.3025850929940459

#ifdef WIDE_VECTORS

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

/* y = b + x W for `count` tiles (a constant where it is called) side by side, even and odd rows apart: enough
   independent sums to keep the processor busy. */
static inline __attribute__((always_inline)) void tiles(const double *w, const double *b, const double *x, int n_in,
                                                        double *y, const int count) {
    const Four *w_0 = (const Four *)w, *w_1 = count > 1 ? w_0 + n_in : w_0, *w_2 = count > 2 ? w_1 + n_in : w_0,
               *w_3 = count > 3 ? w_2 + n_in : w_0;
    Four a_0 = ((const Four *)b)[0], a_1 = {0}, a_2 = {0}, a_3 = {0}, c_0 = {0}, c_1 = {0}, c_2 = {0}, c_3 = {0};
    int i = 0;
    if (count > 1) a_1 = ((const Four *)b)[1];
    if (count > 2) a_2 = ((const Four *)b)[2];
    if (count > 3) a_3 = ((const Four *)b)[3];
    for (; i + 1 < n_in; i += 2) {
        a_0 += w_0[i] * x[i], c_0 += w_0[i + 1] * x[i + 1];
        if (count > 1) a_1 += w_1[i] * x[i], c_1 += w_1[i + 1] * x[i + 1];
        if (count > 2) a_2 += w_2[i] * x[i], c_2 += w_2[i + 1] * x[i + 1];
        if (count > 3) a_3 += w_3[i] * x[i], c_3 += w_3[i + 1] * x[i + 1];
    }
    if (i < n_in) {
        a_0 += w_0[i] * x[i];
        if (count > 1) a_1 += w_1[i] * x[i];
        if (count > 2) a_2 += w_2[i] * x[i];
        if (count > 3) a_3 += w_3[i] * x[i];
    }
    ((Four *)y)[0] = a_0 + c_0;
    if (count > 1) ((Four *)y)[1] = a_1 + c_1;
    if (count > 2) ((Four *)y)[2] = a_2 + c_2;
    if (count > 3) ((Four *)y)[3] = a_3 + c_3;
}

static inline void dense(const double *w, const double *b, const double *x, int n_in, double *y, int n_out) {
    for (; n_out >= 16; n_out -= 16, w += 16 * n_in, b += 16, y += 16) tiles(w, b, x, n_in, y, 4);
    if (n_out == 12) tiles(w, b, x, n_in, y, 3);
    else if (n_out == 8) tiles(w, b, x, n_in, y, 2);
    else if (n_out == 4) tiles(w, b, x, n_in, y, 1);
}

/* The product of two rows whose length is a multiple of four. */
static inline double dot(const double *a, const double *b, int count) {
    Four sum = {0};
    for (int i = 0; i < count; i += 4) sum += *(const Four *)(a + i) * *(const Four *)(b + i);
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

#else

/* y = b + x W; W in tiles of four columns: [tile][row][4]. */
static inline void dense(const double *restrict w, const double *restrict b, const double *restrict x, int n_in,
                         double *restrict y, int n_out) {
    for (int tile = 0; tile < n_out; tile += 4, w += 4 * n_in) {
        double a_0 = b[tile], a_1 = b[tile + 1], a_2 = b[tile + 2], a_3 = b[tile + 3];
        for (int i = 0; i < n_in; i++) {
            a_0 += w[4 * i] * x[i];
            a_1 += w[4 * i + 1] * x[i];
            a_2 += w[4 * i + 2] * x[i];
            a_3 += w[4 * i + 3] * x[i];
        }
        y[tile] = a_0, y[tile + 1] = a_1, y[tile + 2] = a_2, y[tile + 3] = a_3;
    }
}

static inline double dot(const double *a, const double *b, int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) sum += a[i] * b[i];
    return sum;
}

#endif

void LOSS_POWER(double speed, double torque, const double *restrict T, double *restrict power) {
    double pool[N_ROWS + N_LOGS + AT_LEAST_ONE(N_VISCOSITIES)], features[N_FEATURES + 3];
    double first[N_FIRST], second[N_SECOND], net[N_NETS], raw[N_NETS];
    double *const logs = pool + N_ROWS, *const viscosities = logs + N_LOGS;
    double point[2 + N_LOSS_NODES];
    const double n = fabs(speed), moment = fabs(torque);
    const double slow = smaller(n / SPEED_LOW, 1.0), light = smaller(moment / TORQUE_LOW, 1.0);

    point[0] = clamp(n, SPEED_LOW, SPEED_HIGH);
    point[1] = clamp(moment, 0.0, TORQUE_HIGH); /* each network knows its own lowest load */
    for (int i = 0; i < N_LOSS_NODES; i++) point[2 + i] = clamp(T[i], T_LOW, T_HIGH);
    for (int i = 0; i < N_ROWS; i++) pool[i] = clamp(ROW_FACTOR[i] * point[ROW_FROM[i]], ROW_LOWER[i], ROW_UPPER[i]);
    for (int i = 0; i < N_LOGS; i++) logs[i] = pool[LOG_FROM[i]] + LOG_SHIFT[i];
    for (int i = 0; i < N_LOGS; i++) logs[i] = normal_log(logs[i]);
    for (int i = 0; i < N_VISCOSITIES; i++) viscosities[i] = VISCOSITY_M[i] - VISCOSITY_N[i] * logs[VISCOSITY_FROM[i]];
    for (int i = 0; i < N_VISCOSITIES; i++) viscosities[i] = LN_10 * bounded_exp(viscosities[i]);
    for (int i = 0; i < N_FEATURES; i++) features[i] = pool[FEATURE_FROM[i]];
    for (int i = N_FEATURES; i < N_FEATURES + 3; i++) features[i] = 0.0; /* rows of weights end with zeros for these */

    for (const Block *block = BLOCKS; block < BLOCKS + N_BLOCKS; block++)
        dense(block->w_1, block->b_1, features + block->features, block->n_features, first + block->first,
              block->n_first);
    for (int i = 0; i < N_FIRST; i++) first[i] = sigmoid_of_negative(HELD(first[i]));
    for (const Block *block = BLOCKS; block < BLOCKS + N_BLOCKS; block++)
        dense(block->w_2, block->b_2, first + block->first, block->n_first, second + block->second, block->n_second);
    for (int i = 0; i < N_SECOND; i++) second[i] = sigmoid_of_negative(HELD(second[i]));
    for (const Block *block = BLOCKS; block < BLOCKS + N_BLOCKS; block++)
        for (int k = 0; k < block->n_nets; k++) {
            const double hidden = dot(block->w_3 + k * block->n_second, second + block->second, block->n_second);
            raw[block->nets + k] = block->b_3[k] + hidden
                + dot(block->passed + k * block->n_passed, features + block->features, block->n_passed);
        }
    for (int i = 0; i < N_NETS; i++) net[i] = bounded_exp(raw[i]);
    for (int i = 0; i < N_COMPONENTS; i++) {
        const int from = COMPONENT_FROM[i];
        const double loss = COMPONENT_IS_LOG[i] ? net[from] : larger(raw[from], 0.0);
        power[i] = loss * slow * (COMPONENT_DRIVEN[i] ? light : 1.0);
    }
}
