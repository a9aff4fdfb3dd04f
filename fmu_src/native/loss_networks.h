/* The trained networks in place of the full loss model. Numbers and structure: model_data.h. */
#ifndef LOSS_NETWORKS_H
#define LOSS_NETWORKS_H

#include "linker_names.h"

/* Losses in W by component, at speed [1/min], torque [N m] and the temperatures [degC] of LOSS_NODE. */
typedef void LossPower(double speed, double torque, const double *restrict T, double *restrict power);

/* The one that suits this machine. Asking takes a microsecond; the answer is always the same. */
INTERNAL LossPower *loss_power_here(void);

INTERNAL LossPower loss_power_portable;
INTERNAL LossPower loss_power_avx2;

/* How far outside the range of training, as a fraction of it; 0 inside. */
INTERNAL double loss_domain_distance(double speed, double torque, const double *T);

#if defined __GNUC__ && defined __x86_64__
#define HAS_AVX2_VARIANT 1
#else
#define HAS_AVX2_VARIANT 0
#endif
#endif
