/* Heat balance and time integration of a thermal network; the scheme of models/solver.py. */
#ifndef THERMAL_NETWORK_H
#define THERMAL_NETWORK_H

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

/* A network with parameter values. */
typedef struct {
#if N_COMPONENTS
    LossPower *loss_power;
#endif
    double capacity[N_PARTS];
    Balance now, then;
} Network;

/* Node temperatures [degC], the network's memories, and the step size that the last step recommends, s. */
typedef struct {
    double T[N_PARTS], memory[AT_LEAST_ONE(N_MEMORY)], step;
} ThermalState;

#if defined __GNUC__ && !defined _WIN32
#pragma GCC visibility push(hidden)
#endif

/* Take new parameter values; gives NULL, or what is wrong with them. */
const char *network_set(Network *network, const double *parameters);

/* Sources, boundaries and losses at a moment. */
const Balance *network_balance(Network *network, double time, const double *inputs, const ThermalState *state);

#if N_COMPONENTS
/* What the losses depend on at a moment. */
LossPoint network_loss_point(const Network *network, double time, const double *inputs, const ThermalState *state);
#endif

/* Integrate over `duration`, the inputs going straight from `begin` to `end`; gives NULL, or why it cannot be done, and
   *failed_at. */
const char *network_advance(Network *network, ThermalState *state, double time, double duration, const double *begin,
                            const double *end, double *failed_at);

#if defined __GNUC__ && !defined _WIN32
#pragma GCC visibility pop
#endif
#endif
