/* A thermal network as a model for the FMI layer: values in SI units outside, the network in its own units.

   model_data.h defines IN_DOMAIN if the losses are trained networks, TOTAL_LOSS if a source is a loss, and TORQUE_LOSS
   if there is also a shaft with speed and torque. */
#include "model.h"
#include "thermal_network.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define RPM 0.10471975511965977 /* rad/s per 1/min */
#define LEAST_POWER 1e-6 /* W; less is rounding at a shaft that stands */
#define FIRST_STEP_S 0.1

typedef struct {
    double started, stepped, outside; /* 0 or 1: the simulation has begun; a step was done; the range of training is left */
    ThermalState thermal;
    Heat total;                               /* since the start */
    double flow[AT_LEAST_ONE(N_BOUNDARIES)]; /* W to each boundary, mean over the last step */
} State;

const size_t model_state_size = sizeof(State), model_scratch_size = sizeof(Network);

static double inner_after(const Model *model, Place place, double elapsed) {
    return value_after(model, place.reference, elapsed) * place.scale + place.offset;
}

static double inner(const Model *model, Place place) { return inner_after(model, place, 0.0); }

static void show(Model *model, Place place, double value) {
    model->values[place.reference] = (value - place.offset) / place.scale;
}

static void start_values(const Model *model, ThermalState *thermal) {
    const int uniform = model->values[INITIAL_UNIFORM] != 0.0;
    for (int i = 0; i < N_PARTS; i++) thermal->T[i] = inner(model, uniform ? INITIAL_TEMPERATURE : START[i]);
    for (int i = 0; i < N_MEMORY; i++) thermal->memory[i] = inner(model, MEMORY_START[i]);
    thermal->step = FIRST_STEP_S;
}

/* Bring the network up to the present parameters. */
static ModelStatus prepare(Model *model) {
    if (model->changed) {
        double parameters[AT_LEAST_ONE(N_PARAMETERS)] = {0.0};
        const char *fault;
        for (int i = 0; i < N_PARAMETERS; i++) parameters[i] = inner(model, FACTOR[i]);
        fault = network_set(model->scratch, parameters);
        if (fault) {
            snprintf(model->message, MESSAGE_SIZE, "the parameters cannot be used: %s", fault);
            return MODEL_REFUSED;
        }
    }
    model->changed = 0;
    return MODEL_OK;
}

/* A warning about start temperatures that were given but are not used; else no message. */
static ModelStatus unused_starts(Model *model) {
    const double common = model->values[INITIAL_TEMPERATURE.reference];
    int first = -1, count = 0;
    if (model->values[INITIAL_UNIFORM] == 0.0) return MODEL_OK;
    for (int i = 0; i < N_PARTS; i++) {
        const double value = model->values[START[i].reference];
        if (value == model_variables[START[i].reference].start || value == common) continue;
        if (first < 0) first = i;
        count++;
    }
    if (!count) return MODEL_OK;
    model->message[0] = '\0';
    append(model->message, "%s is %g K", model_variables[START[first].reference].name,
           model->values[START[first].reference]);
    if (count > 1) append(model->message, " (and %d more such temperatures are given)", count - 1);
    append(model->message, ", but initial.uniform is true: all parts start at initial.T = %g K. "
           "Set initial.uniform to false to start each part at its own", common);
    return MODEL_WARNING;
}

ModelStatus model_start(Model *model) {
    State *state = model->state;
    if (prepare(model) != MODEL_OK) return MODEL_REFUSED;
    start_values(model, &state->thermal);
    state->started = 1.0;
    return unused_starts(model);
}

#ifdef IN_DOMAIN
static double domain_distance(const LossPoint *point) {
    return loss_domain_distance(point->speed, point->torque, point->T);
}

/* A warning of the operating point that was found outside the range of training at `time`. */
static ModelStatus excursion(Model *model, double time, const LossPoint *point) {
    const char *separator = " ";
    char *text = model->message;
    text[0] = '\0';
    append(text, "at %g s the operating point is outside the range that the networks were trained on:", time);
    if (fabs(point->speed) > SPEED_HIGH) {
        append(text, "%sspeed %g 1/min (to %g)", separator, point->speed, SPEED_HIGH);
        separator = ", ";
    }
    if (fabs(point->torque) > TORQUE_HIGH) {
        append(text, "%storque %g N m (to %g)", separator, point->torque, TORQUE_HIGH);
        separator = ", ";
    }
    for (int i = 0; i < N_LOSS_NODES; i++) {
        if (point->T[i] >= T_LOW && point->T[i] <= T_HIGH) continue;
        append(text, "%s%s %.1f degC (%g to %g)", separator, LOSS_NODE_NAME[i], point->T[i], T_LOW, T_HIGH);
        separator = ", ";
    }
    append(text, ". Losses are extrapolated; in_domain and domain_distance show how long");
    return MODEL_WARNING;
}

/* One warning when the range of training is left during a step, of the first moment that was seen; none while the
   operating point stays outside. */
static ModelStatus watch_domain(Model *model, const LossPoint *begin, const LossPoint *end, double duration) {
    State *state = model->state;
    const int was_outside = state->outside != 0.0;
    state->outside = domain_distance(end) > 0.0;
    if (was_outside) return MODEL_OK;
    if (domain_distance(begin) > 0.0) return excursion(model, model->time, begin);
    return state->outside != 0.0 ? excursion(model, model->time + duration, end) : MODEL_OK;
}
#endif

ModelStatus model_step(Model *model, double duration) {
    State *state = model->state;
    Network *network = model->scratch;
    ThermalState thermal = state->thermal;
    Heat exchanged;
    double before[AT_LEAST_ONE(N_INPUTS)] = {0.0}, inputs[AT_LEAST_ONE(N_INPUTS)] = {0.0}, failed_at;
    const char *fault;
    if (prepare(model) != MODEL_OK) return MODEL_REFUSED;
    for (int i = 0; i < N_INPUTS; i++) {
        before[i] = inner(model, INPUTS[i]);
        inputs[i] = inner_after(model, INPUTS[i], duration);
    }
    fault = network_advance(network, &thermal, model->time, duration, before, inputs, &exchanged,
                            &failed_at);
    if (fault) {
        snprintf(model->message, MESSAGE_SIZE, "the heat balance cannot be solved from %g s on: %s at %g s",
                 model->time, fault, failed_at);
        return MODEL_REFUSED;
    }
    for (int i = 0; i < N_INPUTS; i++)
        model->values[INPUTS[i].reference] = value_after(model, INPUTS[i].reference, duration);
    state->stepped = 1.0;
    state->total.in += exchanged.in;
    for (int i = 0; i < N_BOUNDARIES; i++) {
        state->total.out[i] += exchanged.out[i];
        state->flow[i] = exchanged.out[i] / duration;
    }
#ifdef IN_DOMAIN
    {
        const LossPoint begin = network_loss_point(network, model->time, before, &state->thermal);
        const LossPoint end = network_loss_point(network, model->time + duration, inputs, &thermal);
        state->thermal = thermal;
        return watch_domain(model, &begin, &end, duration);
    }
#else
    state->thermal = thermal;
    return MODEL_OK;
#endif
}

#ifdef TORQUE_LOSS
/* Loss torque, linear through zero below 1 rpm as the losses are, and efficiency. */
static void shaft_outputs(Model *model, double speed, double torque, double loss) {
    const double omega = speed * RPM, power = omega * torque;
    const double useful = power < 0.0 ? -power : fmax(power - loss, 0.0), given = power < 0.0 ? loss - power : power;
    model->values[TORQUE_LOSS] = loss * ((omega > 0.0) - (omega < 0.0)) / fmax(fabs(omega), RPM);
    model->values[EFFICIENCY] = given > LEAST_POWER ? useful / given : 0.0;
}
#endif

ModelStatus model_outputs(Model *model) {
    const State *state = model->state;
    Network *network = model->scratch;
    ThermalState thermal = state->thermal;
    double inputs[AT_LEAST_ONE(N_INPUTS)] = {0.0}, flow[AT_LEAST_ONE(N_BOUNDARIES)] = {0.0};
    const Balance *balance;
    if (prepare(model) != MODEL_OK) return MODEL_REFUSED;
    if (state->started == 0.0) start_values(model, &thermal);
    for (int i = 0; i < N_INPUTS; i++) inputs[i] = inner(model, INPUTS[i]);
    balance = network_balance(network, model->time, inputs, &thermal);
    for (int i = 0; i < N_PARTS; i++) show(model, PART_TEMPERATURE[i], thermal.T[i]);
    for (int i = 0; i < N_BOUNDARIES; i++) show(model, BOUNDARY_TEMPERATURE[i], balance->T_boundary[i]);
    for (int i = 0; i < N_MEMORY; i++) show(model, MEMORY_OUTPUT[i], thermal.memory[i]);
    for (int i = 0; i < N_SOURCES; i++) show(model, HEAT_OUTPUT[i], balance->heat[i]);
    if (state->stepped == 0.0) network_outflow(network, flow);
    else memcpy(flow, state->flow, sizeof flow);
    for (int i = 0; i < N_BOUNDARIES; i++) {
        show(model, BOUNDARY_FLOW[i], flow[i]);
        show(model, BOUNDARY_HEAT[i], state->total.out[i]);
    }
    model->values[HEAT_IN] = model->values[HEAT_STORED] = state->total.in;
    for (int i = 0; i < N_BOUNDARIES; i++) model->values[HEAT_STORED] -= state->total.out[i];
#ifdef TOTAL_LOSS
    model->values[TOTAL_LOSS] = 0.0;
    for (int i = 0; i < N_SOURCES; i++)
        if (SOURCE_IS_LOSS[i]) model->values[TOTAL_LOSS] += balance->heat[i];
#endif
#ifdef TORQUE_LOSS
    shaft_outputs(model, inputs[SPEED_INPUT], inputs[TORQUE_INPUT], model->values[TOTAL_LOSS]);
#endif
#ifdef IN_DOMAIN
    {
        const LossPoint point = network_loss_point(network, model->time, inputs, &thermal);
        model->values[DOMAIN_DISTANCE] = domain_distance(&point);
        model->values[IN_DOMAIN] = model->values[DOMAIN_DISTANCE] <= 0.0;
    }
#endif
    return MODEL_OK;
}
