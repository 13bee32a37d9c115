/* FMI 2.0.4 for co-simulation: the types and functions that a unit exports, as the standard names them.
   Source: Functional Mock-up Interface 2.0.4, sections 2.1 (common) and 4.2 (co-simulation). */
#ifndef CT_FMI2_H
#define CT_FMI2_H

#include <stddef.h>

#ifdef _WIN32
#define CT_EXPORT __declspec(dllexport)
#else
#define CT_EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;

enum { fmi2False, fmi2True };

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String instance, fmi2Status, fmi2String category, fmi2String, ...);
    void *(*allocateMemory)(size_t count, size_t size);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

CT_EXPORT const char *fmi2GetTypesPlatform(void);
CT_EXPORT const char *fmi2GetVersion(void);

CT_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type, fmi2String guid, fmi2String resources,
                                        const fmi2CallbackFunctions *, fmi2Boolean visible, fmi2Boolean logging);
CT_EXPORT void fmi2FreeInstance(fmi2Component);
CT_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component, fmi2Boolean on, size_t n, const fmi2String categories[]);

CT_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component, fmi2Boolean tolerance_defined, fmi2Real tolerance,
                                         fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop);
CT_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component);
CT_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component);
CT_EXPORT fmi2Status fmi2Terminate(fmi2Component);
CT_EXPORT fmi2Status fmi2Reset(fmi2Component);

CT_EXPORT fmi2Status fmi2GetReal(fmi2Component, const fmi2ValueReference[], size_t, fmi2Real[]);
CT_EXPORT fmi2Status fmi2GetInteger(fmi2Component, const fmi2ValueReference[], size_t, fmi2Integer[]);
CT_EXPORT fmi2Status fmi2GetBoolean(fmi2Component, const fmi2ValueReference[], size_t, fmi2Boolean[]);
CT_EXPORT fmi2Status fmi2GetString(fmi2Component, const fmi2ValueReference[], size_t, fmi2String[]);
CT_EXPORT fmi2Status fmi2SetReal(fmi2Component, const fmi2ValueReference[], size_t, const fmi2Real[]);
CT_EXPORT fmi2Status fmi2SetInteger(fmi2Component, const fmi2ValueReference[], size_t, const fmi2Integer[]);
CT_EXPORT fmi2Status fmi2SetBoolean(fmi2Component, const fmi2ValueReference[], size_t, const fmi2Boolean[]);
CT_EXPORT fmi2Status fmi2SetString(fmi2Component, const fmi2ValueReference[], size_t, const fmi2String[]);

CT_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component, fmi2FMUstate *);
CT_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component, fmi2FMUstate);
CT_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate *);
CT_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component, fmi2FMUstate, size_t *);
CT_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component, fmi2FMUstate, fmi2Byte[], size_t);
CT_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component, const fmi2Byte[], size_t, fmi2FMUstate *);

CT_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component, const fmi2ValueReference unknown[], size_t n_unknown,
                                                  const fmi2ValueReference known[], size_t n_known,
                                                  const fmi2Real known_change[], fmi2Real unknown_change[]);
CT_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component, const fmi2ValueReference[], size_t,
                                                 const fmi2Integer order[], const fmi2Real[]);
CT_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component, const fmi2ValueReference[], size_t,
                                                  const fmi2Integer order[], fmi2Real[]);

CT_EXPORT fmi2Status fmi2DoStep(fmi2Component, fmi2Real time, fmi2Real step, fmi2Boolean no_state_before);
CT_EXPORT fmi2Status fmi2CancelStep(fmi2Component);
CT_EXPORT fmi2Status fmi2GetStatus(fmi2Component, fmi2StatusKind, fmi2Status *);
CT_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component, fmi2StatusKind, fmi2Real *);
CT_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component, fmi2StatusKind, fmi2Integer *);
CT_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component, fmi2StatusKind, fmi2Boolean *);
CT_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component, fmi2StatusKind, fmi2String *);

#endif
