/* FMI 3.0.2 for co-simulation: the types and functions that a unit exports, as the standard names them.
   Source: Functional Mock-up Interface 3.0.2, sections 2.2 (common), 3 (model exchange), 4 (co-simulation) and
   5 (scheduled execution); a host looks for the functions of all of them. */
#ifndef CT_FMI3_H
#define CT_FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef CT_EXPORT
#ifdef _WIN32
#define CT_EXPORT __declspec(dllexport)
#else
#define CT_EXPORT __attribute__((visibility("default")))
#endif
#endif

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent
} fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;

typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64 time, fmi3Boolean may_set,
                                               fmi3Boolean may_get, fmi3Boolean finished, fmi3Boolean may_return,
                                               fmi3Boolean *return_early, fmi3Float64 *return_time);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);

/* ---------------------------------------------------------------- common */

CT_EXPORT const char *fmi3GetVersion(void);
CT_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance, fmi3Boolean on, size_t n, const fmi3String categories[]);

CT_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment,
                                                    fmi3LogMessageCallback);
CT_EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                                   fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode,
                                                   fmi3Boolean early_return, const fmi3ValueReference required[],
                                                   size_t n_required, fmi3InstanceEnvironment, fmi3LogMessageCallback,
                                                   fmi3IntermediateUpdateCallback);
CT_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                         fmi3Boolean visible, fmi3Boolean logging,
                                                         fmi3InstanceEnvironment, fmi3LogMessageCallback,
                                                         fmi3ClockUpdateCallback, fmi3LockPreemptionCallback,
                                                         fmi3UnlockPreemptionCallback);
CT_EXPORT void fmi3FreeInstance(fmi3Instance);

CT_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                                 fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop);
CT_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance);
CT_EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance);
CT_EXPORT fmi3Status fmi3Terminate(fmi3Instance);
CT_EXPORT fmi3Status fmi3Reset(fmi3Instance);

CT_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64[], size_t);
CT_EXPORT fmi3Status fmi3GetInt32(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Int32[], size_t);
CT_EXPORT fmi3Status fmi3GetInt64(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Int64[], size_t);
CT_EXPORT fmi3Status fmi3GetBoolean(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Boolean[], size_t);
CT_EXPORT fmi3Status fmi3GetString(fmi3Instance, const fmi3ValueReference[], size_t, fmi3String[], size_t);
CT_EXPORT fmi3Status fmi3GetFloat32(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float32[], size_t);
CT_EXPORT fmi3Status fmi3GetInt8(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Int8[], size_t);
CT_EXPORT fmi3Status fmi3GetUInt8(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt8[], size_t);
CT_EXPORT fmi3Status fmi3GetInt16(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Int16[], size_t);
CT_EXPORT fmi3Status fmi3GetUInt16(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt16[], size_t);
CT_EXPORT fmi3Status fmi3GetUInt32(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt32[], size_t);
CT_EXPORT fmi3Status fmi3GetUInt64(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt64[], size_t);
CT_EXPORT fmi3Status fmi3GetBinary(fmi3Instance, const fmi3ValueReference[], size_t, size_t sizes[],
                                   fmi3Binary[], size_t);
CT_EXPORT fmi3Status fmi3GetClock(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Clock[]);

CT_EXPORT fmi3Status fmi3SetFloat64(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Float64[], size_t);
CT_EXPORT fmi3Status fmi3SetInt32(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int32[], size_t);
CT_EXPORT fmi3Status fmi3SetInt64(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int64[], size_t);
CT_EXPORT fmi3Status fmi3SetBoolean(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Boolean[], size_t);
CT_EXPORT fmi3Status fmi3SetString(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3String[], size_t);
CT_EXPORT fmi3Status fmi3SetFloat32(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Float32[], size_t);
CT_EXPORT fmi3Status fmi3SetInt8(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int8[], size_t);
CT_EXPORT fmi3Status fmi3SetUInt8(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt8[], size_t);
CT_EXPORT fmi3Status fmi3SetInt16(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int16[], size_t);
CT_EXPORT fmi3Status fmi3SetUInt16(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt16[], size_t);
CT_EXPORT fmi3Status fmi3SetUInt32(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt32[], size_t);
CT_EXPORT fmi3Status fmi3SetUInt64(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt64[], size_t);
CT_EXPORT fmi3Status fmi3SetBinary(fmi3Instance, const fmi3ValueReference[], size_t, const size_t sizes[],
                                   const fmi3Binary[], size_t);
CT_EXPORT fmi3Status fmi3SetClock(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Clock[]);

CT_EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance, fmi3ValueReference, size_t *n);
CT_EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance, fmi3ValueReference dependent, size_t elements[],
                                                 fmi3ValueReference independents[], size_t their_elements[],
                                                 fmi3DependencyKind[], size_t n);

CT_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance, fmi3FMUState *);
CT_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance, fmi3FMUState);
CT_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance, fmi3FMUState *);
CT_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance, fmi3FMUState, size_t *);
CT_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance, fmi3FMUState, fmi3Byte[], size_t);
CT_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance, const fmi3Byte[], size_t, fmi3FMUState *);

CT_EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                                  const fmi3ValueReference knowns[], size_t n_knowns,
                                                  const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[],
                                                  size_t n_sensitivity);
CT_EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                              const fmi3ValueReference knowns[], size_t n_knowns,
                                              const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[],
                                              size_t n_sensitivity);

/* ---------------------------------------------------------------- co-simulation */

CT_EXPORT fmi3Status fmi3GetOutputDerivatives(fmi3Instance, const fmi3ValueReference[], size_t,
                                              const fmi3Int32 orders[], fmi3Float64[], size_t);
CT_EXPORT fmi3Status fmi3DoStep(fmi3Instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_state_before,
                                fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                                fmi3Float64 *last_time);

/* functions that this unit does not support */

CT_EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance);
CT_EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance);
CT_EXPORT fmi3Status fmi3GetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64[],
                                            fmi3IntervalQualifier[]);
CT_EXPORT fmi3Status fmi3GetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt64[],
                                             fmi3UInt64[], fmi3IntervalQualifier[]);
CT_EXPORT fmi3Status fmi3GetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64[]);
CT_EXPORT fmi3Status fmi3GetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt64[],
                                          fmi3UInt64[]);
CT_EXPORT fmi3Status fmi3SetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Float64[]);
CT_EXPORT fmi3Status fmi3SetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt64[],
                                             const fmi3UInt64[]);
CT_EXPORT fmi3Status fmi3SetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Float64[]);
CT_EXPORT fmi3Status fmi3SetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt64[],
                                          const fmi3UInt64[]);
CT_EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance);
CT_EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance, fmi3Boolean *, fmi3Boolean *, fmi3Boolean *, fmi3Boolean *,
                                              fmi3Boolean *, fmi3Float64 *);
CT_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance);
CT_EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance);
CT_EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance, fmi3Boolean, fmi3Boolean *, fmi3Boolean *);
CT_EXPORT fmi3Status fmi3SetTime(fmi3Instance, fmi3Float64);
CT_EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance, const fmi3Float64[], size_t);
CT_EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance, fmi3Float64[], size_t);
CT_EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance, fmi3Float64[], size_t);
CT_EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance, fmi3Float64[], size_t);
CT_EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance, fmi3Float64[], size_t);
CT_EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance, size_t *);
CT_EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance, size_t *);
CT_EXPORT fmi3Status fmi3ActivateModelPartition(fmi3Instance, fmi3ValueReference, fmi3Float64);

#endif
