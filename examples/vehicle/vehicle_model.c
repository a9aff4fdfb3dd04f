/* A light vehicle for the gearbox to work in: driver, engine, brakes, road. Implements model.h.

   The driver follows a speed with a PI controller; engine and brakes follow the driver with a lag, so no output depends
   on an input at the same moment and co-simulation needs no iteration. The loss torque of the gearbox comes back as an
   input and brakes the engine. Every step moves the vehicle by forces F over the mean of its speeds before and after,
   so that the works of all forces add up to the kinetic energy to rounding. */
#include "model.h"
#include "vehicle_references.h"

#include <math.h>
#include <stdio.h>

#define LONGEST_INNER_STEP_S 0.005
#define LONGEST_STEP_S 3600.0
#define GRAVITY 9.81    /* m/s^2 */
#define AIR_DENSITY 1.2 /* kg/m^3 */
#define CREEP 0.05      /* m/s: below it, what opposes motion goes linearly through zero */
#define STANDING 0.2    /* m/s: slower than this, and asked to stand, the driver lets go and the brake holds */
#define HOLDING 1.0     /* m/s^2: by which the brake then could slow the vehicle down */
#define HARDEST 6.0     /* m/s^2: by which the brakes can slow the vehicle down */
#define LETTING_GO_S 0.5
#define AT_REST 1e-12   /* m/s: no smaller speeds, which processors calculate slowly in the end */

typedef struct {
    double started, speed, distance; /* 0 or 1; m/s; m */
    double integral;                 /* m/s^2: acceleration that the driver has learnt to need */
    double torque, brake;            /* N m at the gearbox's input shaft; N at the wheels */
    double engine, loss, road, braked; /* works since the start, J */
} State;

const size_t model_state_size = sizeof(State), model_scratch_size = sizeof(double);

static double inertia(const double *v) { /* kg: mass and what turns with it */
    const double per_speed = v[RATIO] / v[TYRE_RADIUS];
    return v[MASS] + v[INERTIA_SHAFT] * per_speed * per_speed + v[INERTIA_WHEELS] / (v[TYRE_RADIUS] * v[TYRE_RADIUS]);
}

static double opposing(double speed) { return speed / sqrt(speed * speed + CREEP * CREEP); }

static double clamped(double value, double low, double high) { return fmin(fmax(value, low), high); }

/* The driver's wish and what engine and brakes make of it during h. */
static void drive(const double *v, double demand, double h, State *s) {
    const double per_speed = v[RATIO] / v[TYRE_RADIUS], lag = -expm1(-h / v[ACTUATOR_TIME]);
    const double error = demand - s->speed, mass = inertia(v);
    const double force = mass * (error / v[DRIVER_TIME] + s->integral), hardest = HARDEST * v[MASS];
    const double high = fmin(v[ENGINE_TORQUE_MAX], v[ENGINE_POWER_MAX] / fmax(fabs(s->speed) * per_speed, 1e-3));
    const double low = -v[ENGINE_TORQUE_BRAKING];
    double torque = clamped(force / per_speed, low, high);
    double brake = clamped(low * per_speed - force, 0.0, hardest);
    const int saturated = (force > high * per_speed && error > 0.0) || (force < low * per_speed - hardest && error < 0.0);
    if (demand < STANDING && fabs(s->speed) < STANDING) {
        torque = 0.0;
        brake = HOLDING * v[MASS];
        s->integral *= exp(-h / LETTING_GO_S);
    } else if (!saturated) {
        s->integral += h * error / (v[DRIVER_TIME] * v[DRIVER_RESET_TIME]);
    }
    s->torque = fmin(s->torque + lag * (torque - s->torque), high);
    s->brake += lag * (brake - s->brake);
}

typedef struct { double engine, loss, road, brake; } Forces; /* N at the wheels, positive forwards */

static Forces forces(const double *v, const State *s, double speed, double torque_loss, double slope) {
    const double per_speed = v[RATIO] / v[TYRE_RADIUS], weight = v[MASS] * GRAVITY, length = sqrt(1.0 + slope * slope);
    Forces f;
    f.engine = s->torque * per_speed;
    f.loss = -fabs(torque_loss) * per_speed * opposing(speed);
    f.road = -0.5 * AIR_DENSITY * v[DRAG_AREA] * speed * fabs(speed) - weight * slope / length
           - v[ROLLING_RESISTANCE] * weight / length * opposing(speed);
    f.brake = -s->brake * opposing(speed);
    return f;
}

static double sum(Forces f) { return f.engine + f.loss + f.road + f.brake; }

static void move(const double *v, double h, double torque_loss, double slope, State *s) {
    const double mass = inertia(v);
    const double middle = s->speed + 0.5 * h * sum(forces(v, s, s->speed, torque_loss, slope)) / mass;
    const Forces f = forces(v, s, middle, torque_loss, slope);
    const double reached = s->speed + h * sum(f) / mass;
    const double after = fabs(reached) < AT_REST ? 0.0 : reached, way = 0.5 * h * (s->speed + after);
    s->engine += f.engine * way;
    s->loss -= f.loss * way;
    s->road -= f.road * way;
    s->braked -= f.brake * way;
    s->distance += way;
    s->speed = after;
}

ModelStatus model_start(Model *model) {
    ((State *)model->state)->started = 1.0; /* at rest, all books empty */
    return MODEL_OK;
}

ModelStatus model_step(Model *model, double duration) {
    double *v = model->values;
    State state = *(State *)model->state;
    /* A little more room: masters that add up their steps give 0.1 s as 0.1000000001 s now and then. */
    const double parts = ceil(fmin(duration, LONGEST_STEP_S) / LONGEST_INNER_STEP_S - 1e-3);
    const long steps = (long)fmax(parts, 1.0);
    const double h = duration / (double)steps;
    if (duration > LONGEST_STEP_S) {
        snprintf(model->message, MESSAGE_SIZE, "a step of %g s is too long for a vehicle; up to %g s is possible", duration,
                 LONGEST_STEP_S);
        return MODEL_REFUSED;
    }
    for (long i = 0; i < steps; i++) {
        const double t = ((double)i + 0.5) * h;
        drive(v, value_after(model, SPEED_DEMAND, t), h, &state);
        move(v, h, value_after(model, TORQUE_LOSS, t), value_after(model, SLOPE, t), &state);
    }
    if (!isfinite(state.speed)) {
        snprintf(model->message, MESSAGE_SIZE, "the motion cannot be followed with these parameters; check mass and inertia");
        return MODEL_REFUSED;
    }
    *(State *)model->state = state;
    v[SPEED_DEMAND] = value_after(model, SPEED_DEMAND, duration);
    v[TORQUE_LOSS] = value_after(model, TORQUE_LOSS, duration);
    v[SLOPE] = value_after(model, SLOPE, duration);
    return MODEL_OK;
}

ModelStatus model_outputs(Model *model) {
    const State *s = model->state;
    double *v = model->values;
    v[SHAFT_SPEED] = s->speed * v[RATIO] / v[TYRE_RADIUS];
    v[SHAFT_TORQUE] = s->torque;
    v[SPEED] = s->speed;
    v[DISTANCE] = s->distance;
    v[ENERGY_ENGINE] = s->engine;
    v[ENERGY_LOSS] = s->loss;
    v[ENERGY_ROAD] = s->road;
    v[ENERGY_BRAKE] = s->braked;
    v[ENERGY_KINETIC] = 0.5 * inertia(v) * s->speed * s->speed;
    return MODEL_OK;
}
