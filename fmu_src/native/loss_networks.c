/* The trained networks for any processor, which variant of them suits this one, and the range of training. */
#define LOSS_POWER loss_power_portable
#include "loss_kernel.h"

#if HAS_AVX2_VARIANT
#include <cpuid.h>

/* Whether the processor has AVX2 and FMA, and the operating system saves their registers. */
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
    double distance = larger((fabs(speed) - SPEED_HIGH) / (SPEED_HIGH - SPEED_LOW),
                             (fabs(torque) - TORQUE_HIGH) / (TORQUE_HIGH - TORQUE_LOW));
    double off = larger(T[0] - T_HIGH, T_LOW - T[0]);
    for (int i = 1; i < N_LOSS_NODES; i++) off = larger(off, larger(T[i] - T_HIGH, T_LOW - T[i]));
    return larger(larger(distance, off / (T_HIGH - T_LOW)), 0.0);
}
