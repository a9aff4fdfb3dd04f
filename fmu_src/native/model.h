/* A model as the FMI layer (instance.c) sees it: a table of variables and three functions. Free of FMI.

   Values stand in one array of doubles, one per variable in the order of the table; the place in the table is the value
   reference. The FMI layer guards them: whenever the model is called, all inputs and parameters are finite and within
   their bounds but for rounding, fixed parameters have not changed since the start, and the calls come in an allowed
   order. */
#ifndef MODEL_H
#define MODEL_H

#include "linker_names.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

typedef enum { REAL, BOOLEAN } VariableType;
typedef enum { CALCULATED, INPUT, FIXED, TUNABLE } VariableAccess; /* FIXED: until the simulation starts */

typedef struct {
    const char *name, *unit;
    VariableType type;
    VariableAccess access;
    double start, minimum, maximum, nominal;
} Variable;

enum { MESSAGE_SIZE = 1024 };

typedef struct {
    double *values;       /* by value reference; the model writes the calculated ones, and the inputs after a ramp */
    const double *slopes; /* by value reference: rate of every input during the next step, 1/s */
    void *state;          /* model_state_size bytes that the future depends on: no pointers, zero before the start */
    void *scratch;        /* model_scratch_size bytes of the model's own; not saved, all zero when instantiated */
    double time;          /* s; the FMI layer moves it on after a step */
    int changed;          /* parameters were set or restored since the model took them over, which clears it */
    char message[MESSAGE_SIZE]; /* of a warning or refusal */
} Model;

typedef enum {
    MODEL_OK,
    MODEL_WARNING, /* done, with a message */
    MODEL_REFUSED  /* not done, with a message; values and state are as before */
} ModelStatus;

/* Generated */
INTERNAL extern const char model_guid[];
INTERNAL extern const unsigned model_variable_count;
INTERNAL extern const Variable model_variables[];

/* A settable value `elapsed` s into the next step, within its bounds to the last bit: laws may take roots of it. */
static inline double value_after(const Model *model, unsigned reference, double elapsed) {
    const Variable *variable = &model_variables[reference];
    const double value = model->values[reference] + model->slopes[reference] * elapsed;
    return value < variable->minimum ? variable->minimum : value > variable->maximum ? variable->maximum : value;
}

/* Add to a message of MESSAGE_SIZE; what does not fit is cut off. */
static inline void append(char *message, const char *format, ...) {
    const size_t length = strlen(message);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message + length, MESSAGE_SIZE - length, format, arguments);
    va_end(arguments);
}

/* Written with the model */
INTERNAL extern const size_t model_state_size;
INTERNAL extern const size_t model_scratch_size;

/* Take the start values over into the state, at model->time. */
INTERNAL ModelStatus model_start(Model *model);

/* Go on by `duration` s (> 0) from model->time. Inputs go from their values along their slopes; those that do have
   their end values afterwards. */
INTERNAL ModelStatus model_step(Model *model, double duration);

/* Write the calculated values at model->time; before model_start those at the start. */
INTERNAL ModelStatus model_outputs(Model *model);

#endif
