/* The trained networks in place of the full loss model. Numbers and structure: model_data.h. */
#ifndef LOSS_NETWORKS_H
#define LOSS_NETWORKS_H

#include "linker_names.h"

/* Losses in W by component, at speed [1/min], torque [N m] and the temperatures [degC] of LOSS_NODE. */
typedef void LossPower(double speed, double torque, const double *RESTRICT T, double *RESTRICT power);

/* The one that suits this machine. Asking takes a microsecond; the answer is always the same. */
INTERNAL LossPower *loss_power_here(void);

INTERNAL LossPower loss_power_portable;
INTERNAL LossPower loss_power_avx2;

/* How far outside the range of training, as a fraction of it; 0 inside. */
INTERNAL double loss_domain_distance(double speed, double torque, const double *T);

/* GCC aligns the stack to 16 bytes on 64-bit Windows, and vectors of 32 that it puts there need more (GCC bug 54412). */
#if defined __GNUC__ && defined __x86_64__ && (defined __clang__ || !defined _WIN32)
#define HAS_AVX2_VARIANT 1
#else
#define HAS_AVX2_VARIANT 0
#endif
#endif
