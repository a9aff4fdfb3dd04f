/* The gearbox twin as a model for the FMI layer: values in SI units outside, the thermal network in its own units. */
#include "loss_networks.h"
#include "model.h"
#include "thermal_network.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define RPM 0.10471975511965977 /* rad/s per 1/min */
#define FIRST_STEP_S 0.1

typedef struct {
    double started, outside; /* 0 or 1: the simulation has begun; it was told that the range of training was left */
    ThermalState thermal;
} State;

typedef struct {
    int usable; /* the network has the present parameters */
    Network network;
} Scratch;

const size_t model_state_size = sizeof(State), model_scratch_size = sizeof(Scratch);

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
    memcpy(thermal->memory, MEMORY_START, sizeof thermal->memory);
    thermal->step = FIRST_STEP_S;
}

/* Bring the network up to the present parameters. */
static ModelStatus prepare(Model *model) {
    Scratch *scratch = model->scratch;
    if (model->changed & CHANGED_PARAMETERS) {
        double parameters[AT_LEAST_ONE(N_PARAMETERS)];
        const char *fault;
        for (int i = 0; i < N_PARAMETERS; i++) parameters[i] = inner(model, FACTOR[i]);
        fault = network_set(&scratch->network, parameters);
        if (fault) {
            snprintf(model->message, MESSAGE_SIZE, "the parameters cannot be used: %s", fault);
            return MODEL_REFUSED;
        }
    }
    model->changed = 0;
    return MODEL_OK;
}

/* Add to a message; what does not fit is cut off. */
static void append(char *message, const char *format, ...) {
    const size_t length = strlen(message);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message + length, MESSAGE_SIZE - length, format, arguments);
    va_end(arguments);
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

static void loss_temperatures(const ThermalState *thermal, double *T) {
    for (int i = 0; i < N_LOSS_NODES; i++) T[i] = thermal->T[LOSS_NODE[i]];
}

/* A warning of the operating point that was found outside the range of training at `time`. */
static ModelStatus excursion(Model *model, double time, const double *inputs, const double *T) {
    const char *separator = " ";
    char *text = model->message;
    text[0] = '\0';
    append(text, "at %g s the operating point is outside the range that the networks were trained on:", time);
    if (fabs(inputs[0]) > SPEED_HIGH) {
        append(text, "%sspeed %g 1/min (to %g)", separator, inputs[0], SPEED_HIGH);
        separator = ", ";
    }
    if (fabs(inputs[1]) > TORQUE_HIGH) {
        append(text, "%storque %g N m (to %g)", separator, inputs[1], TORQUE_HIGH);
        separator = ", ";
    }
    for (int i = 0; i < N_LOSS_NODES; i++) {
        if (T[i] >= T_LOW && T[i] <= T_HIGH) continue;
        append(text, "%s%s %.1f degC (%g to %g)", separator, LOSS_NODE_NAME[i], T[i], T_LOW, T_HIGH);
        separator = ", ";
    }
    append(text, ". Losses are held at the edge of the range; in_domain and domain_distance show how long");
    return MODEL_WARNING;
}

ModelStatus model_step(Model *model, double duration) {
    State *state = model->state;
    Scratch *scratch = model->scratch;
    ThermalState thermal = state->thermal;
    const int was_outside = state->outside != 0.0;
    double before[N_INPUTS], inputs[N_INPUTS], T[N_LOSS_NODES], T_before[N_LOSS_NODES], failed_at;
    const char *fault;
    int at_once;
    if (prepare(model) != MODEL_OK) return MODEL_REFUSED;
    for (int i = 0; i < N_INPUTS; i++) {
        before[i] = inner(model, INPUTS[i]);
        inputs[i] = inner_after(model, INPUTS[i], duration);
    }
    loss_temperatures(&thermal, T_before);
    at_once = !was_outside && loss_domain_distance(before[0], before[1], T_before) > 0.0;
    fault = network_advance(&scratch->network, &thermal, model->time, duration, before, inputs, &failed_at);
    if (fault) {
        snprintf(model->message, MESSAGE_SIZE, "the heat balance cannot be solved from %g s on: %s at %g s",
                 model->time, fault, failed_at);
        return MODEL_REFUSED;
    }
    state->thermal = thermal;
    for (int i = 0; i < N_INPUTS; i++)
        model->values[INPUTS[i].reference] = value_after(model, INPUTS[i].reference, duration);
    loss_temperatures(&thermal, T);
    state->outside = loss_domain_distance(inputs[0], inputs[1], T) > 0.0;
    /* One warning when the range is left, of the first moment that it was seen; none while it stays outside. */
    if (at_once) return excursion(model, model->time, before, T_before);
    if (state->outside != 0.0 && !was_outside) return excursion(model, model->time + duration, inputs, T);
    return MODEL_OK;
}

ModelStatus model_outputs(Model *model) {
    const State *state = model->state;
    Scratch *scratch = model->scratch;
    ThermalState thermal = state->thermal;
    double inputs[N_INPUTS], T[N_LOSS_NODES], loss = 0.0, omega, power, useful, given, distance;
    const Balance *balance;
    if (prepare(model) != MODEL_OK) return MODEL_REFUSED;
    if (state->started == 0.0) start_values(model, &thermal);
    for (int i = 0; i < N_INPUTS; i++) inputs[i] = inner(model, INPUTS[i]);
    loss_temperatures(&thermal, T);
    balance = network_balance(&scratch->network, model->time, inputs, &thermal);
    for (int i = 0; i < N_PARTS; i++) show(model, PART_TEMPERATURE[i], thermal.T[i]);
    for (int i = 0; i < N_BOUNDARIES; i++) show(model, BOUNDARY_TEMPERATURE[i], balance->T_boundary[i]);
    for (int i = 0; i < N_MEMORY; i++) show(model, MEMORY_OUTPUT[i], thermal.memory[i]);
    for (int i = 0; i < N_SOURCES; i++) {
        show(model, HEAT_OUTPUT[i], balance->heat[i]);
        if (SOURCE_IS_LOSS[i]) loss += balance->heat[i];
    }
    /* The loss torque goes linearly through zero below 1 rpm, as the losses do. */
    omega = inputs[0] * RPM;
    power = omega * inputs[1];
    useful = power < 0.0 ? -power : fmax(power - loss, 0.0);
    given = power < 0.0 ? loss - power : power;
    distance = loss_domain_distance(inputs[0], inputs[1], T);
    model->values[TOTAL_LOSS] = loss;
    model->values[TORQUE_LOSS] = loss * ((omega > 0.0) - (omega < 0.0)) / fmax(fabs(omega), RPM);
    model->values[EFFICIENCY] = given > 0.0 ? useful / given : 0.0;
    model->values[DOMAIN_DISTANCE] = distance;
    model->values[IN_DOMAIN] = distance <= 0.0;
    return MODEL_OK;
}
