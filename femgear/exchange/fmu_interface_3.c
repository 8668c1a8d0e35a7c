/* What FMI 3.0 asks of a unit, by the functions for FMI 2.0 above: Modelica Association, Functional Mock-up Interface
   3.0.2, 2024. All variables are of the type Float64. */

#include <stdint.h>

typedef void (*Fmi3Log)(void *environment, int status, const char *category, const char *message);

typedef struct {
  Instance base;
  Fmi3Log log;
  void *environment;
} Instance3;

static void tell_3(fmi2ComponentEnvironment instance, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String format, ...) {
  Instance3 *told = (Instance3 *)instance;
  char text[256];
  va_list values;
  (void)name;
  va_start(values, format);
  vsnprintf(text, sizeof text, format, values);
  va_end(values);
  if (told->log) told->log(told->environment, (int)status, category, text);
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const names[]) {
  (void)c, (void)on, (void)n, (void)names;
  return fmi2OK;
}

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                         bool logging, bool events, bool early, const uint32_t wanted[], size_t n,
                                         void *environment, Fmi3Log log, void *update) {
  Instance3 *instance;
  (void)resources, (void)visible, (void)logging, (void)events, (void)early, (void)wanted, (void)n, (void)update;
  if (!token || strcmp(token, GUID)) return NULL;
  instance = (Instance3 *)calloc(1, sizeof(Instance3));
  if (!instance) return NULL;
  instance->log = log, instance->environment = environment;
  instance->base.calls.logger = tell_3, instance->base.calls.componentEnvironment = instance;
  begin(&instance->base, name);
  return instance;
}

EXPORT void fmi3FreeInstance(void *c) { free(c); }

EXPORT int fmi3EnterInitializationMode(void *c, bool limited, double tolerance, double start, bool ends, double stop) {
  (void)limited, (void)tolerance, (void)ends, (void)stop;
  ((Instance *)c)->state.time = start;
  return fmi2OK;
}

EXPORT int fmi3ExitInitializationMode(void *c) { return NAME(fmi2ExitInitializationMode)(c); }
EXPORT int fmi3EnterStepMode(void *c) { return NAME(fmi2Terminate)(c); }
EXPORT int fmi3Terminate(void *c) { return NAME(fmi2Terminate)(c); }
EXPORT int fmi3Reset(void *c) { return NAME(fmi2Reset)(c); }

/* the time stands behind the other variables */
EXPORT int fmi3GetFloat64(void *c, const uint32_t vr[], size_t n, double value[], size_t values) {
  size_t i;
  fmi2Status status;
  if (values != n) return fmi2Error;
  for (i = 0; i < n; i++) {
    if (vr[i] == VARIABLES) {
      value[i] = ((Instance *)c)->state.time;
      continue;
    }
    status = NAME(fmi2GetReal)(c, vr + i, 1, value + i);
    if (status != fmi2OK) return status;
  }
  return fmi2OK;
}

EXPORT int fmi3SetFloat64(void *c, const uint32_t vr[], size_t n, const double value[], size_t values) {
  return values == n ? NAME(fmi2SetReal)(c, vr, n, value) : fmi2Error;
}

EXPORT int fmi3DoStep(void *c, double time, double size, bool kept, bool *event, bool *ends, bool *early, double *last) {
  fmi2Status status = NAME(fmi2DoStep)(c, time, size, kept);
  *event = *ends = *early = false;
  *last = ((Instance *)c)->state.time;
  return status;
}

EXPORT int fmi3GetFMUState(void *c, void **copy) { return NAME(fmi2GetFMUstate)(c, copy); }
EXPORT int fmi3SetFMUState(void *c, void *copy) { return NAME(fmi2SetFMUstate)(c, copy); }
EXPORT int fmi3FreeFMUState(void *c, void **copy) { return NAME(fmi2FreeFMUstate)(c, copy); }

EXPORT int fmi3GetNumberOfVariableDependencies(void *c, uint32_t vr, size_t *n) {
  (void)c, (void)vr;
  *n = 0;
  return fmi2Error;
}

/* types that no variable has */
#define NONE_OF(type, word)                                                                               \
  EXPORT int fmi3Get##word(void *c, const uint32_t vr[], size_t n, type value[], size_t values) {         \
    (void)vr, (void)value;                                                                                \
    if (n || values) say((Instance *)c, fmi2Error, "this unit has no variables of the type " #word);      \
    return n || values ? fmi2Error : fmi2OK;                                                              \
  }                                                                                                       \
  EXPORT int fmi3Set##word(void *c, const uint32_t vr[], size_t n, const type value[], size_t values) {   \
    (void)vr, (void)value;                                                                                \
    if (n || values) say((Instance *)c, fmi2Error, "this unit has no variables of the type " #word);      \
    return n || values ? fmi2Error : fmi2OK;                                                              \
  }
NONE_OF(float, Float32)
NONE_OF(int8_t, Int8)
NONE_OF(uint8_t, UInt8)
NONE_OF(int16_t, Int16)
NONE_OF(uint16_t, UInt16)
NONE_OF(int32_t, Int32)
NONE_OF(uint32_t, UInt32)
NONE_OF(int64_t, Int64)
NONE_OF(uint64_t, UInt64)
NONE_OF(bool, Boolean)
NONE_OF(char *, String)

/* what the description says that this unit has not */
#define REFUSED_3(name, ...)                                                     \
  EXPORT int name(void *c, __VA_ARGS__) {                                      \
    say((Instance *)c, fmi2Error, #name " is none of the abilities of this unit"); \
    return fmi2Error;                                                            \
  }
#define REFUSED_MODE(name)                                                       \
  EXPORT int name(void *c) {                                                     \
    say((Instance *)c, fmi2Error, #name " is none of the abilities of this unit"); \
    return fmi2Error;                                                            \
  }
#define REFERENCES const uint32_t vr[], size_t n
REFUSED_MODE(fmi3EnterConfigurationMode)
REFUSED_MODE(fmi3ExitConfigurationMode)
REFUSED_MODE(fmi3EnterContinuousTimeMode)
REFUSED_MODE(fmi3EnterEventMode)
REFUSED_MODE(fmi3EvaluateDiscreteStates)
REFUSED_3(fmi3ActivateModelPartition, uint32_t clock, double time)
REFUSED_3(fmi3CompletedIntegratorStep, bool kept, bool *event, bool *ends)
REFUSED_3(fmi3UpdateDiscreteStates, bool *again, bool *ends, bool *nominals, bool *states, bool *next, double *time)
REFUSED_3(fmi3SetTime, double time)
REFUSED_3(fmi3GetContinuousStates, double value[], size_t n)
REFUSED_3(fmi3SetContinuousStates, const double value[], size_t n)
REFUSED_3(fmi3GetContinuousStateDerivatives, double value[], size_t n)
REFUSED_3(fmi3GetNominalsOfContinuousStates, double value[], size_t n)
REFUSED_3(fmi3GetNumberOfContinuousStates, size_t *n)
REFUSED_3(fmi3GetEventIndicators, double value[], size_t n)
REFUSED_3(fmi3GetNumberOfEventIndicators, size_t *n)
REFUSED_3(fmi3GetOutputDerivatives, REFERENCES, const int32_t order[], double value[], size_t values)
REFUSED_3(fmi3GetDirectionalDerivative, REFERENCES, const uint32_t of[], size_t k, const double seed[], size_t seeds,
          double value[], size_t values)
REFUSED_3(fmi3GetAdjointDerivative, REFERENCES, const uint32_t of[], size_t k, const double seed[], size_t seeds,
          double value[], size_t values)
REFUSED_3(fmi3GetVariableDependencies, uint32_t vr, size_t index[], uint32_t of[], size_t index_of[], int kind[],
          size_t n)
REFUSED_3(fmi3SerializedFMUStateSize, void *state, size_t *size)
REFUSED_3(fmi3SerializeFMUState, void *state, uint8_t bytes[], size_t size)
REFUSED_3(fmi3DeserializeFMUState, const uint8_t bytes[], size_t size, void **state)
REFUSED_3(fmi3GetBinary, REFERENCES, size_t size[], const uint8_t *value[], size_t values)
REFUSED_3(fmi3SetBinary, REFERENCES, const size_t size[], const uint8_t *const value[], size_t values)
REFUSED_3(fmi3GetClock, REFERENCES, bool value[])
REFUSED_3(fmi3SetClock, REFERENCES, const bool value[])
REFUSED_3(fmi3GetIntervalDecimal, REFERENCES, double value[], int qualifier[])
REFUSED_3(fmi3SetIntervalDecimal, REFERENCES, const double value[])
REFUSED_3(fmi3GetIntervalFraction, REFERENCES, uint64_t value[], uint64_t of[], int qualifier[])
REFUSED_3(fmi3SetIntervalFraction, REFERENCES, const uint64_t value[], const uint64_t of[])
REFUSED_3(fmi3GetShiftDecimal, REFERENCES, double value[])
REFUSED_3(fmi3SetShiftDecimal, REFERENCES, const double value[])
REFUSED_3(fmi3GetShiftFraction, REFERENCES, uint64_t value[], uint64_t of[])
REFUSED_3(fmi3SetShiftFraction, REFERENCES, const uint64_t value[], const uint64_t of[])

EXPORT void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible,
                                          bool logging, void *environment, Fmi3Log log) {
  return NULL;
}

EXPORT void *fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *resources, bool visible,
                                               bool logging, void *environment, Fmi3Log log, void *update, void *lock,
                                               void *unlock) {
  return NULL;
}
