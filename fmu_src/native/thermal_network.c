/* Heat balance and time integration of a thermal network.

   ROS2 of Verwer, Spee, Blom and Hundsdorfer (SIAM J. Sci. Comput. 20, 1999) with the conductance matrix as Jacobian:
   second order, L-stable, two balances per step, step size by the embedded first-order solution; constants and choices
   are those of models/portable/solver.py, which says more. Each step solves three systems (C + gamma h L) k = q with the
   symmetric conductance matrix L, by generated code that makes no product with a zero. */
#include "thermal_network.h"
#include "elementary.h"
#include "laws.h"

#define GAMMA 0.29289321881345247 /* 1 - sqrt(1/2) */
#define TOLERANCE_K 0.03
#define FULL_WEIGHT_J_K 2.5
#define MOST_STEPS 100000
#define STILL_K 0.1
#define SHORTEST_STEP_S 1e-6
#define SAFETY 0.9
#define SHRINK 0.2
#define GROW 5.0

const char *network_set(Network *network, const double *parameters) {
    Balance *const balances[] = {&network->now, &network->then};
    double fixed[N_FIXED + N_PARTS];
    int fine = 1;
    law_fixed(parameters, fixed);
    for (int i = 0; i < N_FIXED + N_PARTS; i++) fine = fine && isfinite(fixed[i]);
    for (int i = 0; i < N_PARTS; i++) fine = fine && fixed[N_FIXED + i] > 0.0;
    if (!fine) return "heat capacities must be positive and conductances finite; check the parameters";
    memcpy(network->capacity, fixed + N_FIXED, sizeof network->capacity);
    for (int i = 0; i < N_PARTS; i++) network->weight[i] = smaller(network->capacity[i] / FULL_WEIGHT_J_K, 1.0);
    for (int i = 0; i < 2; i++) {
        balances[i]->valid = 0;
        memcpy(balances[i]->conductance, fixed, N_FIXED * sizeof(double));
        memcpy(balances[i]->at.parameters, parameters, N_PARAMETERS * sizeof(double));
    }
#if N_COMPONENTS
    memcpy(network->asked.parameters, parameters, N_PARAMETERS * sizeof(double));
    if (!network->loss_power) network->loss_power = loss_power_here();
#endif
    return NULL;
}

/* Set a moment: all that the laws depend on but parameters and losses. */
static void set_moment(Signals *at, double time, const double *inputs, const ThermalState *state) {
    at->time = time;
    memcpy(at->inputs, inputs, N_INPUTS * sizeof(double));
    memcpy(at->T, state->T, sizeof at->T);
    memcpy(at->memory, state->memory, sizeof at->memory);
}

#if N_COMPONENTS
static LossPoint loss_point(const Signals *at) {
    double operating[2];
    LossPoint point;
    law_operating((const double *)at, operating);
    point.speed = operating[0];
    point.torque = operating[1];
    for (int i = 0; i < N_LOSS_NODES; i++) point.T[i] = at->T[LOSS_NODE[i]];
    return point;
}

LossPoint network_loss_point(Network *network, double time, const double *inputs, const ThermalState *state) {
    set_moment(&network->asked, time, inputs, state);
    return loss_point(&network->asked);
}
#endif

#if N_COMPONENTS
/* Losses at a moment: those of `near` (may be NULL) where speed and torque are the same and no temperature that they
   depend on is more than STILL_K away. */
static void find_losses(const Network *network, Balance *balance, const Balance *near) {
    int still = near != NULL;
    balance->point = loss_point(&balance->at);
    still = still && near->point.speed == balance->point.speed && near->point.torque == balance->point.torque;
    for (int i = 0; i < N_LOSS_NODES; i++) still = still && fabs(near->point.T[i] - balance->point.T[i]) <= STILL_K;
    if (still)
        memcpy(balance->at.power, near->at.power, sizeof balance->at.power);
    else
        network->loss_power(balance->point.speed, balance->point.torque, balance->point.T, balance->at.power);
}
#endif

/* Fill `balance` for a moment, unless it holds that moment already; `near` as for find_losses. */
static void find_balance(const Network *network, Balance *balance, double time, const double *inputs,
                         const ThermalState *state, const Balance *near) {
    Signals *at = &balance->at;
    if (!near && balance->valid && (at->time == time || !LAWS_USE_TIME)
        && !memcmp(at->inputs, inputs, N_INPUTS * sizeof(double)) && !memcmp(at->T, state->T, sizeof at->T)
        && !memcmp(at->memory, state->memory, sizeof at->memory)) return;
    set_moment(at, time, inputs, state);
#if N_COMPONENTS
    find_losses(network, balance, near);
#else
    (void)network;
#endif
    law_boundary((const double *)at, balance->T_boundary);
    law_heat((const double *)at, balance->heat);
    balance->valid = 1;
    balance->has_gain = 0;
}

static void find_gain(Balance *balance) {
    if (balance->has_gain) return;
    law_exchange((const double *)&balance->at, balance->conductance + N_FIXED);
    structure_gain(balance->conductance, balance->at.T, balance->T_boundary, balance->heat, balance->gain);
    balance->has_gain = 1;
}

const Balance *network_balance(Network *network, double time, const double *inputs, const ThermalState *state) {
    find_balance(network, &network->now, time, inputs, state, NULL);
    return &network->now;
}

void network_outflow(Network *network, double *flow) {
    Balance *const now = &network->now;
    find_gain(now);
    structure_outflow(now->conductance, now->at.T, now->T_boundary, flow);
}

/* Add the heat of an accepted step h: the stages k_1 and k_2 with the weights of the temperatures, 3/2 and 1/2, so that
   what leaves the nodes arrives at the boundaries, to rounding. */
static void add_heat(Heat *heat, const Balance *now, const Balance *then, const double *k_1, const double *k_2,
                     double h) {
    double sum = 0.0, T[N_PARTS], first[AT_LEAST_ONE(N_BOUNDARIES)], second[AT_LEAST_ONE(N_BOUNDARIES)];
    for (int i = 0; i < N_PARTS; i++) T[i] = now->at.T[i] + GAMMA * h * (k_1[i] + k_2[i]);
    structure_outflow(now->conductance, T, now->T_boundary, first);
    structure_outflow(then->conductance, then->at.T, then->T_boundary, second);
    for (int i = 0; i < N_BOUNDARIES; i++) heat->out[i] += 0.5 * h * (first[i] + second[i]);
    for (int i = 0; i < N_SOURCES; i++) sum += now->heat[i] + then->heat[i];
    heat->in += 0.5 * h * sum;
}

/* Inputs at a share of the way from `begin` to `end`. */
static void ramp(const double *begin, const double *end, double share, double *inputs) {
    for (int i = 0; i < N_INPUTS; i++) inputs[i] = begin[i] + (end[i] - begin[i]) * share;
}

/* Update the memories; gives the largest change of a rate by that (K/s of a part, by its weight), 0 if none changed. */
static double update_memory(Network *network, double time, const double *inputs, ThermalState *state) {
    Balance *const now = &network->now;
    double gain[N_PARTS], rate[AT_LEAST_ONE(N_MEMORY)], jump = 1e-12;
    find_balance(network, now, time, inputs, state, NULL);
    if (!memcmp(state->memory, now->heat + N_SOURCES + N_MEMORY, sizeof state->memory)) return 0.0;
    find_gain(now);
    memcpy(gain, now->gain, sizeof gain);
    memcpy(rate, now->heat + N_SOURCES, sizeof rate);
    memcpy(state->memory, now->heat + N_SOURCES + N_MEMORY, sizeof state->memory);
    find_balance(network, now, time, inputs, state, NULL);
    find_gain(now);
    for (int i = 0; i < N_PARTS; i++)
        jump = larger(jump, network->weight[i] * fabs(now->gain[i] - gain[i]) / network->capacity[i]);
    for (int i = 0; i < N_MEMORY; i++) jump = larger(jump, fabs(now->heat[N_SOURCES + i] - rate[i]));
    return jump;
}

const char *network_advance(Network *network, ThermalState *state, double time, double duration, const double *begin,
                            const double *end, Heat *exchanged, double *failed_at) {
    Balance *const now = &network->now, *const then = &network->then;
    const double *const capacity = network->capacity;
    /* A switch acts before `switch_by`; a step of `narrow` that meets it is short enough. */
    double elapsed = 0.0, switch_by = INFINITY, narrow = 0.0;
    int tried = 0;
    memset(exchanged, 0, sizeof *exchanged);
    while (elapsed < duration) {
        const double remaining = duration - elapsed, step = larger(state->step, SHORTEST_STEP_S);
        /* Two even steps instead of a full one and a sliver. */
        const double even = step >= remaining ? remaining : smaller(step, 0.5 * remaining);
        const double to_switch = switch_by - elapsed;
        const double h = smaller(even, to_switch <= narrow ? to_switch : 0.5 * to_switch);
        const double end_of_step = h == remaining ? duration : h == to_switch ? switch_by : elapsed + h;
        double factors[N_FACTORS];
        double now_inputs[AT_LEAST_ONE(N_INPUTS)] = {0.0}, then_inputs[AT_LEAST_ONE(N_INPUTS)] = {0.0};
        double k_1[N_PARTS], k_2[N_PARTS], both[N_PARTS];
        double rate_1[AT_LEAST_ONE(N_MEMORY)], rate_2[AT_LEAST_ONE(N_MEMORY)];
        const double early = elapsed + GAMMA * h, late = elapsed + (1.0 - GAMMA) * h;
        double error = 0.0, sum = 0.0, next_step;
        ThermalState later = *state;
        Heat heat;
        *failed_at = time + elapsed;
        if (tried++ == MOST_STEPS) return "the communication step needs more than 100000 steps; make it shorter. They end";
        ramp(begin, end, early / duration, now_inputs);
        ramp(begin, end, late / duration, then_inputs);
        find_balance(network, now, time + early, now_inputs, state, NULL);
        find_gain(now);
        structure_factorize(now->conductance, capacity, GAMMA * h, factors);
        structure_solve(factors, now->gain, k_1);
        for (int i = 0; i < N_PARTS; i++) later.T[i] = state->T[i] + h * k_1[i];
        for (int i = 0; i < N_MEMORY; i++) {
            rate_1[i] = now->heat[N_SOURCES + i];
            later.memory[i] = state->memory[i] + h * rate_1[i];
        }
        find_balance(network, then, time + late, then_inputs, &later, now);
        find_gain(then);
        for (int i = 0; i < N_PARTS; i++) k_2[i] = then->gain[i] - 2.0 * capacity[i] * k_1[i];
        structure_solve(factors, k_2, k_2);
        /* Filtered once more by the implicit matrix: what a stiff node relaxes within the step is no error of it. */
        for (int i = 0; i < N_PARTS; i++) both[i] = capacity[i] * (k_1[i] + k_2[i]);
        structure_solve(factors, both, both);
        for (int i = 0; i < N_PARTS; i++) {
            error = larger(error, fabs(both[i]) * network->weight[i]);
            sum += both[i];
        }
        for (int i = 0; i < N_MEMORY; i++) {
            rate_2[i] = then->heat[N_SOURCES + i] - 2.0 * rate_1[i];
            error = larger(error, fabs(rate_1[i] + rate_2[i]));
            sum += rate_2[i];
        }
        if (!isfinite(sum)) return "the heat balance is not finite";
        error *= 0.5 * h / TOLERANCE_K;
        next_step = h * smaller(GROW, larger(SHRINK, SAFETY / sqrt(larger(error, 1e-12))));
        if (error > 1.0) {
            if (next_step < SHORTEST_STEP_S) return "the step size fell below 1e-06 s";
            state->step = next_step;
            continue;
        }
        for (int i = 0; i < N_PARTS; i++) later.T[i] = state->T[i] + h * (1.5 * k_1[i] + 0.5 * k_2[i]);
        for (int i = 0; i < N_MEMORY; i++)
            later.memory[i] = state->memory[i] + h * (1.5 * rate_1[i] + 0.5 * rate_2[i]);
        heat = *exchanged;
        add_heat(&heat, now, then, k_1, k_2, h);
        if (LAWS_UPDATE) {
            double jump;
            ramp(begin, end, end_of_step / duration, now_inputs);
            jump = update_memory(network, time + end_of_step, now_inputs, &later);
            if (jump > 0.0) narrow = TOLERANCE_K / jump;
            if (jump > 0.0 && h > larger(narrow, SHORTEST_STEP_S)) {
                switch_by = end_of_step;
                continue;
            }
            if (jump > 0.0 || end_of_step >= switch_by) switch_by = INFINITY;
        }
        elapsed = end_of_step;
        *exchanged = heat;
        /* A short communication step says nothing about the step that the network would allow. */
        later.step = h < step ? larger(next_step, step) : next_step;
        *state = later;
    }
    return NULL;
}
