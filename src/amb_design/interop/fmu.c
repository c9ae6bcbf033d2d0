/* FMI 3.0 for a machine (ME: model exchange around the generated ode) or its sampled controllers (co-simulation).
 * NX states, NU inputs, NY outputs; value references: 0 time, then inputs, outputs, states, derivatives.
 */
#include "fmi3Functions.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef ME
#include "ode.c"
#else
#include "controller.c"
#endif

typedef struct {
    double time, u[NU + 1], y[NY + 1], x[NX + 1], dx[NX + 1];
    int fresh;
#ifdef ME
    casadi_real *w;
    casadi_int *iw;
    const casadi_real **arg;
    casadi_real **res;
#else
    controller_state law;
#endif
} Unit;

static const double starts[NU + 1] = STARTS;

static void reset(Unit *unit)
{
    unit->time = 0;
    unit->fresh = 0;
    memcpy(unit->u, starts, sizeof unit->u);
    memset(unit->x, 0, sizeof unit->x);
    memset(unit->y, 0, sizeof unit->y);
#ifndef ME
    controller_reset(&unit->law);
#endif
}

static void evaluate(Unit *unit)
{
#ifdef ME
    if (unit->fresh) return;
    unit->arg[0] = unit->x;
    unit->arg[1] = unit->u;
    unit->res[0] = unit->dx;
    unit->res[1] = unit->y;
    ode(unit->arg, unit->res, unit->iw, unit->w, 0);
    unit->fresh = 1;
#endif
}

static fmi3Instance made(fmi3String token)
{
    Unit *unit;
    if (!token || strcmp(token, TOKEN)) return NULL;
    unit = (Unit *)calloc(1, sizeof(Unit));
    if (!unit) return NULL;
#ifdef ME
    {
        casadi_int arg, res, iw, w;
        ode_work(&arg, &res, &iw, &w);
        unit->arg = (const casadi_real **)calloc((size_t)arg + 1, sizeof(casadi_real *));
        unit->res = (casadi_real **)calloc((size_t)res + 1, sizeof(casadi_real *));
        unit->iw = (casadi_int *)calloc((size_t)iw + 1, sizeof(casadi_int));
        unit->w = (casadi_real *)calloc((size_t)w + 1, sizeof(casadi_real));
    }
#endif
    reset(unit);
    return unit;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance i, fmi3Boolean on, size_t n, const fmi3String c[]) { return fmi3OK; }

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment env, fmi3LogMessageCallback log)
{
#ifdef ME
    return made(token);
#else
    return NULL;
#endif
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference vr[], size_t n,
    fmi3InstanceEnvironment env, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
#ifdef ME
    return NULL;
#else
    return made(token);
#endif
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment env, fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    Unit *unit = (Unit *)instance;
    if (!unit) return;
#ifdef ME
    free((void *)unit->arg);
    free(unit->res);
    free(unit->iw);
    free(unit->w);
#endif
    free(unit);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance i, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start,
    fmi3Boolean stops, fmi3Float64 stop)
{
    ((Unit *)i)->time = start;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3EnterEventMode(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance i) { return fmi3OK; }

fmi3Status fmi3Reset(fmi3Instance i)
{
    reset((Unit *)i);
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance i, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t count)
{
    Unit *unit = (Unit *)i;
    size_t k;
    evaluate(unit);
    if (n != count) return fmi3Error;
    for (k = 0; k < n; ++k) {
        size_t v = vr[k];
        if (v == 0) values[k] = unit->time;
        else if (v <= NU) values[k] = unit->u[v - 1];
        else if (v <= NU + NY) values[k] = unit->y[v - 1 - NU];
        else if (v <= NU + NY + NX) values[k] = unit->x[v - 1 - NU - NY];
        else if (v <= NU + NY + 2 * NX) values[k] = unit->dx[v - 1 - NU - NY - NX];
        else return fmi3Error;
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(
    fmi3Instance i, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[], size_t count)
{
    Unit *unit = (Unit *)i;
    size_t k;
    if (n != count) return fmi3Error;
    unit->fresh = 0;
    for (k = 0; k < n; ++k) {
        size_t v = vr[k];
        if (v >= 1 && v <= NU) unit->u[v - 1] = values[k];
        else if (v > NU + NY && v <= NU + NY + NX) unit->x[v - 1 - NU - NY] = values[k];
        else return fmi3Error;
    }
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance i, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals,
    fmi3Boolean *states, fmi3Boolean *next, fmi3Float64 *time)
{
    *again = *end = *nominals = *states = *next = fmi3False;
    *time = 0;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance i) { return fmi3OK; }

#ifdef ME
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance i) { return fmi3OK; }

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance i, fmi3Boolean no_set, fmi3Boolean *event, fmi3Boolean *end)
{
    *event = *end = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance i, fmi3Float64 time)
{
    ((Unit *)i)->time = time;
    return fmi3OK;
}

fmi3Status fmi3SetContinuousStates(fmi3Instance i, const fmi3Float64 x[], size_t n)
{
    if (n != NX) return fmi3Error;
    memcpy(((Unit *)i)->x, x, NX * sizeof(double));
    ((Unit *)i)->fresh = 0;
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance i, fmi3Float64 x[], size_t n)
{
    if (n != NX) return fmi3Error;
    memcpy(x, ((Unit *)i)->x, NX * sizeof(double));
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance i, fmi3Float64 dx[], size_t n)
{
    if (n != NX) return fmi3Error;
    evaluate((Unit *)i);
    memcpy(dx, ((Unit *)i)->dx, NX * sizeof(double));
    return fmi3OK;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance i, fmi3Float64 x[], size_t n)
{
    size_t k;
    for (k = 0; k < n; ++k) x[k] = 1e-3;
    return fmi3OK;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance i, fmi3Float64 z[], size_t n) { return n ? fmi3Error : fmi3OK; }

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance i, size_t *n)
{
    *n = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance i, size_t *n)
{
    *n = NX;
    return fmi3OK;
}
#else
fmi3Status fmi3EnterStepMode(fmi3Instance i) { return fmi3OK; }

fmi3Status fmi3DoStep(fmi3Instance i, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set, fmi3Boolean *event,
    fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *reached)
{
    Unit *unit = (Unit *)i;
    double count = floor(step / PERIOD + 0.5), k;
    *event = *end = *early = fmi3False;
    *reached = time;
    if (count < 1 || fabs(step / PERIOD - count) > 1e-6) return fmi3Error;
    for (k = 0; k < count; ++k) controller_step(&unit->law, unit->u, unit->y);
    unit->time = *reached = time + step;
    return fmi3OK;
}
#endif
