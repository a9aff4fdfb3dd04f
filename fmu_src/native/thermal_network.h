/* Heat balance and time integration of a thermal network; the scheme of models/portable/solver.py. */
#ifndef THERMAL_NETWORK_H
#define THERMAL_NETWORK_H

#include "linker_names.h"
#include "model_data.h"

#if N_COMPONENTS /* the losses are trained networks */
#include "loss_networks.h"

/* What the losses depend on: speed [1/min] and torque [N m] as they see them, and temperatures of LOSS_NODE [degC]. */
typedef struct {
    double speed, torque, T[N_LOSS_NODES];
} LossPoint;
#endif

/* What goes into the laws, in the order of their arguments. */
typedef struct {
    double time, inputs[AT_LEAST_ONE(N_INPUTS)], T[N_PARTS], parameters[AT_LEAST_ONE(N_PARAMETERS)],
        memory[AT_LEAST_ONE(N_MEMORY)], power[AT_LEAST_ONE(N_COMPONENTS)];
} Signals;

/* The heat balance at one moment. */
typedef struct {
    int valid, has_gain; /* outputs need no gain */
    Signals at;
    double heat[AT_LEAST_ONE(N_SOURCES + 2 * N_MEMORY)]; /* W; then the rates of the memories and their updates */
    double T_boundary[AT_LEAST_ONE(N_BOUNDARIES)];
    double conductance[AT_LEAST_ONE(N_FIXED + N_VARYING)]; /* W/K */
    double gain[N_PARTS];                                  /* W: net heat into the parts */
} Balance;

/* Heat of the sources and to each boundary, J. */
typedef struct {
    double in, out[AT_LEAST_ONE(N_BOUNDARIES)];
} Heat;

/* A network with parameter values. */
typedef struct {
#if N_COMPONENTS
    LossPower *loss_power;
    Signals asked; /* of network_loss_point */
#endif
    double capacity[N_PARTS], weight[N_PARTS]; /* J/K; of the errors in the step control */
    Balance now, then;
} Network;

/* Node temperatures [degC], the network's memories, and the step size that the last step recommends, s. */
typedef struct {
    double T[N_PARTS], memory[AT_LEAST_ONE(N_MEMORY)], step;
} ThermalState;

/* Take new parameter values; gives NULL, or what is wrong with them. */
INTERNAL const char *network_set(Network *network, const double *parameters);

/* Sources, boundaries and losses at a moment. */
INTERNAL const Balance *network_balance(Network *network, double time, const double *inputs, const ThermalState *state);

#if N_COMPONENTS
/* What the losses depend on at a moment. */
INTERNAL LossPoint network_loss_point(Network *network, double time, const double *inputs,
                                      const ThermalState *state);
#endif

/* Heat flow to each boundary at the moment of the last network_balance, W. */
INTERNAL void network_outflow(Network *network, double *flow);

/* Integrate over `duration`, the inputs going straight from `begin` to `end`, and find the heat that is exchanged
   meanwhile; gives NULL, or why it cannot be done, and *failed_at. */
INTERNAL const char *network_advance(Network *network, ThermalState *state, double time, double duration,
                                     const double *begin, const double *end, Heat *exchanged, double *failed_at);

#endif
