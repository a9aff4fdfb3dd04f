/* Functions of FMI 3.0 that a library must have and this FMU has no use for: variables of other types, clocks, events,
   configuration, adjoint derivatives, model exchange, scheduled execution. All return an error with a message. */
#include "instance.h"

#include "fmi3Functions.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

static fmi3Status absent(fmi3Instance instance, const char *function) {
    if (!instance_allows(instance, ANY_MODE, function)) return fmi3Error;
    return (fmi3Status)instance_report(instance, STATUS_ERROR, "%s: this FMU does not provide it", function);
}

#define NO_VARIABLES(Type)                                                                                             \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                       \
                             size_t nValueReferences, fmi3##Type values[], size_t nValues) {                           \
        return (fmi3Status)instance_without(instance, nValueReferences, #Type, __func__);                              \
    }                                                                                                                  \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                       \
                             size_t nValueReferences, const fmi3##Type values[], size_t nValues) {                     \
        return (fmi3Status)instance_without(instance, nValueReferences, #Type, __func__);                              \
    }

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues) {
    return (fmi3Status)instance_without(instance, nValueReferences, "Binary", __func__);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues) {
    return (fmi3Status)instance_without(instance, nValueReferences, "Binary", __func__);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[]) {
    return (fmi3Status)instance_without(instance, nValueReferences, "Clock", __func__);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Clock values[]) {
    return (fmi3Status)instance_without(instance, nValueReferences, "Clock", __func__);
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t nValues) {
    if (nValueReferences) return absent(instance, __func__);
    return instance_allows(instance, ANY_MODE, __func__) ? fmi3OK : fmi3Error;
}

/* Functions that take an instance alone, and those that take more. */
#define ABSENT(name)                                                                                                   \
    fmi3Status name(fmi3Instance instance) { return absent(instance, __func__); }
#define ABSENT_WITH(name, ...)                                                                                         \
    fmi3Status name(fmi3Instance instance, __VA_ARGS__) { return absent(instance, __func__); }

ABSENT(fmi3EnterConfigurationMode)
ABSENT(fmi3ExitConfigurationMode)
ABSENT(fmi3EnterEventMode)
ABSENT(fmi3EnterStepMode)
ABSENT(fmi3EnterContinuousTimeMode)
ABSENT(fmi3EvaluateDiscreteStates)
ABSENT_WITH(fmi3UpdateDiscreteStates, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
            fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
            fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime)
ABSENT_WITH(fmi3GetIntervalDecimal, const fmi3ValueReference valueReferences[], size_t nValueReferences,
            fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ABSENT_WITH(fmi3GetIntervalFraction, const fmi3ValueReference valueReferences[], size_t nValueReferences,
            fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
ABSENT_WITH(fmi3GetShiftDecimal, const fmi3ValueReference valueReferences[], size_t nValueReferences,
            fmi3Float64 shifts[])
ABSENT_WITH(fmi3GetShiftFraction, const fmi3ValueReference valueReferences[], size_t nValueReferences,
            fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ABSENT_WITH(fmi3SetIntervalDecimal, const fmi3ValueReference valueReferences[], size_t nValueReferences,
            const fmi3Float64 intervals[])
ABSENT_WITH(fmi3SetIntervalFraction, const fmi3ValueReference valueReferences[], size_t nValueReferences,
            const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT_WITH(fmi3SetShiftDecimal, const fmi3ValueReference valueReferences[], size_t nValueReferences,
            const fmi3Float64 shifts[])
ABSENT_WITH(fmi3SetShiftFraction, const fmi3ValueReference valueReferences[], size_t nValueReferences,
            const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT_WITH(fmi3GetNumberOfVariableDependencies, fmi3ValueReference valueReference, size_t *nDependencies)
ABSENT_WITH(fmi3GetVariableDependencies, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
            fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
            fmi3DependencyKind dependencyKinds[], size_t nDependencies)
ABSENT_WITH(fmi3GetAdjointDerivative, const fmi3ValueReference unknowns[], size_t nUnknowns,
            const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
            fmi3Float64 sensitivity[], size_t nSensitivity)
ABSENT_WITH(fmi3CompletedIntegratorStep, fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *enterEventMode,
            fmi3Boolean *terminateSimulation)
ABSENT_WITH(fmi3SetTime, fmi3Float64 time)
ABSENT_WITH(fmi3SetContinuousStates, const fmi3Float64 continuousStates[], size_t nContinuousStates)
ABSENT_WITH(fmi3GetContinuousStates, fmi3Float64 continuousStates[], size_t nContinuousStates)
ABSENT_WITH(fmi3GetContinuousStateDerivatives, fmi3Float64 derivatives[], size_t nContinuousStates)
ABSENT_WITH(fmi3GetNominalsOfContinuousStates, fmi3Float64 nominals[], size_t nContinuousStates)
ABSENT_WITH(fmi3GetEventIndicators, fmi3Float64 eventIndicators[], size_t nEventIndicators)
ABSENT_WITH(fmi3GetNumberOfEventIndicators, size_t *nEventIndicators)
ABSENT_WITH(fmi3GetNumberOfContinuousStates, size_t *nContinuousStates)
ABSENT_WITH(fmi3ActivateModelPartition, fmi3ValueReference clockReference, fmi3Float64 activationTime)
