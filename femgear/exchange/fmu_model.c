/* Co-simulation of the vibration of a gear train by FMI 2.0, in C99 without libraries but that of C.

   Data of the train stand above this text: sizes, modes, tables over the angle, start values. The motion is

     eta'' + 2 zeta omega eta' + omega^2 eta = input_rows^T u - mesh_rows^T g
     x = mesh_rows eta - mesh_residual g + mesh_by_input u,   g = f(x, phase) - mesh_stiffness x

   with the force f = force + stiffness (x - deflection) of every mesh, whose tables run with its phase. That is so many
   times the phase of the first mesh as its ratio says, and ahead of it by a constant. Flanks that may
   part have max(f, 0), and beyond the backlash the same with the other sign. Steps are those of Dormand and Prince, J.
   Comput. Appl. Math. 6, 1980, 19-26, of order 5 with an error estimate of order 4. */

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef int fmi2StatusKind;
typedef struct {
  void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
  void *(*allocateMemory)(size_t, size_t);
  void (*freeMemory)(void *);
  void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
  fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#ifdef FMI2_FUNCTION_PREFIX
#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define NAME(name) JOIN(FMI2_FUNCTION_PREFIX, name)
#else
#define NAME(name) name
#endif

#define STATES (1 + 2 * MODES)
#define STAGES 7
#define SMALLEST 1e-15

/* value references, in the order of modelDescription.xml */
enum { DAMPING, START, TOLERANCE, SPEED, LOADS };
#define PHASE (LOADS + LOAD_COUNT)
#define DEFLECTIONS (PHASE + 1)
#define FORCES (DEFLECTIONS + MESHES)
#define SEEN (FORCES + MESHES)
#define RATES (SEEN + SHOWN)
#define SHAKEN (RATES + ROTATIONS)
#define SENSOR (SHAKEN + ACCELERATIONS)
#define VARIABLES (SENSOR + SENSORS)

typedef struct {
  double set[PHASE];     /* parameters and inputs */
  double time, step;     /* step: that of the integration, 0 before the first */
  double y[STATES];      /* angle of the input, modes, their rates */
  double value[VARIABLES];
  int known;             /* whether the values are those of this state */
  int begun;             /* whether the initialization is over */
} State;

typedef struct {
  State state;
  double k[STAGES][STATES], trial[STATES];
  char name[64];
  fmi2CallbackFunctions calls;
} Instance;

static void say(Instance *instance, fmi2Status status, const char *text) {
  if (instance->calls.logger)
    instance->calls.logger(instance->calls.componentEnvironment, instance->name, status, "model", "%s", text);
}

/* rotation of the input by the motions without strain: added to its mean angle it is what the teeth see */
static double turned(const double *y) {
  double sum = 0.0;
  int i;
  for (i = 0; i < RIGID; i++) sum += driver_row[i] * y[1 + i];
  return y[0] + sum;
}

/* mesh periods of the first mesh */
static double phase_of(const State *s, const double *y) { return s->set[START] + MESH_RATE * turned(y); }

static double phase_of_mesh(int mesh, double phase) { return mesh_ratio[mesh] * phase + mesh_ahead[mesh]; }

/* weights of the four points around a phase, and the first of these */
static int weights(double phase, double *w) {
  double at = phase / PERIODS, t;
  int first;
  at = (at - floor(at)) * POSITIONS;
  first = (int)at;
  t = at - first;
  w[0] = -t * (t - 1.0) * (t - 2.0) / 6.0;
  w[1] = (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0;
  w[2] = -(t + 1.0) * t * (t - 2.0) / 2.0;
  w[3] = (t + 1.0) * t * (t - 1.0) / 6.0;
  return (first + POSITIONS - 1) % POSITIONS;
}

static double between(const double *table, int first, const double *w) {
  double sum = 0.0;
  int i;
  for (i = 0; i < 4; i++) sum += w[i] * table[(first + i) % POSITIONS];
  return sum;
}

/* force of a mesh and its tangent at a deflection */
static double law(int mesh, double k, double line, double *tangent) {
  double back;
  *tangent = k;
  if (!SEPARATES || line > 0.0) return line;
  back = backlash[mesh] > 0.0 ? -(line + k * backlash[mesh]) : 0.0;
  if (back > 0.0) return -back;
  *tangent = 0.0;
  return 0.0;
}

/* solve a x = b of size MESHES by elimination with pivots, in place */
static int eliminate(double a[MESHES][MESHES], double *b) {
  int i, j, k, pivot;
  double factor, kept;
  for (k = 0; k < MESHES; k++) {
    pivot = k;
    for (i = k + 1; i < MESHES; i++)
      if (fabs(a[i][k]) > fabs(a[pivot][k])) pivot = i;
    if (a[pivot][k] == 0.0) return 0;
    if (pivot != k) {
      for (j = 0; j < MESHES; j++) kept = a[k][j], a[k][j] = a[pivot][j], a[pivot][j] = kept;
      kept = b[k], b[k] = b[pivot], b[pivot] = kept;
    }
    for (i = k + 1; i < MESHES; i++) {
      factor = a[i][k] / a[k][k];
      if (factor == 0.0) continue;
      for (j = k; j < MESHES; j++) a[i][j] -= factor * a[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (k = MESHES - 1; k >= 0; k--) {
    for (j = k + 1; j < MESHES; j++) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
  return 1;
}

/* inputs u, deflections x, forces f and what they have beyond the mean stiffness g; 0 where there is no solution */
static int meshes(const State *s, const double *y, double *u, double *x, double *f, double *g) {
  double w[4], k[MESHES], d[MESHES], load[MESHES], free[MESHES], slope[MESHES], a[MESHES][MESHES], b[MESHES], change, size;
  double phase = phase_of(s, y);
  int i, j, c, round, first = weights(phase, w);
  for (c = 0; c < LOAD_COUNT; c++) u[c] = s->set[LOADS + c];
  for (c = LOAD_COUNT; c < INPUTS; c++) u[c] = between(friction_table[c - LOAD_COUNT], first, w);
  for (j = 0; j < MESHES; j++) {
    first = weights(phase_of_mesh(j, phase), w);
    k[j] = between(stiffness_table[j], first, w);
    d[j] = between(deflection_table[j], first, w);
    load[j] = between(force_table[j], first, w);
    free[j] = 0.0;
    for (i = 0; i < MODES; i++) free[j] += mesh_rows[j][i] * y[1 + i];
    for (c = 0; c < INPUTS; c++) free[j] += mesh_by_input[j][c] * u[c];
    x[j] = free[j];
  }
  for (round = 0; round < 50; round++) {
    for (j = 0; j < MESHES; j++) {
      f[j] = law(j, k[j], load[j] + k[j] * (x[j] - d[j]), &slope[j]);
      g[j] = f[j] - mesh_stiffness[j] * x[j];
    }
    change = size = 0.0;
    for (i = 0; i < MESHES; i++) {
      b[i] = free[i] - x[i];
      for (j = 0; j < MESHES; j++) {
        b[i] -= mesh_residual[i][j] * g[j];
        a[i][j] = (i == j) + mesh_residual[i][j] * (slope[j] - mesh_stiffness[j]);
      }
      change += fabs(b[i]), size += fabs(x[i]);
    }
    if (change <= 1e-14 * size || size == 0.0) return 1;
    if (!eliminate(a, b)) return 0;
    for (j = 0; j < MESHES; j++) x[j] += b[j];
  }
  return change <= 1e-9 * size;
}

/* acceleration of a mode by the inputs u and the mesh forces g */
static double modal_acceleration(const State *s, const double *y, const double *u, const double *g, int i) {
  double sum = -omega[i] * (omega[i] * y[1 + i] + 2.0 * s->set[DAMPING] * zeta[i] * y[1 + MODES + i]);
  int j, c;
  for (j = 0; j < MESHES; j++) sum -= mesh_rows[j][i] * g[j];
  for (c = 0; c < INPUTS; c++) sum += input_rows[c][i] * u[c];
  return sum;
}

static int rates(const State *s, const double *y, double *dy) {
  double u[INPUTS + 1], x[MESHES], f[MESHES], g[MESHES];
  int i;
  if (!meshes(s, y, u, x, f, g)) return 0;
  dy[0] = s->set[SPEED];
  for (i = 0; i < MODES; i++) {
    dy[1 + i] = y[1 + MODES + i];
    dy[1 + MODES + i] = modal_acceleration(s, y, u, g, i);
  }
  return 1;
}

/* root of twice the energy of the modes */
static double energy(const double *y) {
  double sum = 0.0;
  int i;
  for (i = 0; i < MODES; i++)
    sum += omega[i] * omega[i] * y[1 + i] * y[1 + i] + y[1 + MODES + i] * y[1 + MODES + i];
  return sqrt(sum);
}

static int advance(Instance *instance, double until) {
  static const double c[STAGES][STAGES] = {
      {0},
      {1.0 / 5},
      {3.0 / 40, 9.0 / 40},
      {44.0 / 45, -56.0 / 15, 32.0 / 9},
      {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
      {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
      {35.0 / 384, 0.0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
  static const double e[STAGES] = {71.0 / 57600, 0.0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525,
                                   -1.0 / 40};
  State *s = &instance->state;
  double (*k)[STATES] = instance->k, *y = instance->trial, error[STATES], h, wrong, size, left;
  int stage, before, i, last;
  if (s->step <= 0.0) s->step = 0.1 / omega[MODES - 1];
  if (!rates(s, s->y, k[0])) return 0;
  while ((left = until - s->time) > SMALLEST * fabs(until)) {
    last = s->step >= left;
    h = last ? left : s->step;
    for (stage = 1; stage < STAGES; stage++) {
      for (i = 0; i < STATES; i++) {
        y[i] = 0.0;
        for (before = 0; before < stage; before++) y[i] += c[stage][before] * k[before][i];
        y[i] = s->y[i] + h * y[i];
      }
      if (!rates(s, y, k[stage])) return 0;
    }
    for (i = 0; i < STATES; i++) {
      error[i] = 0.0;
      for (stage = 0; stage < STAGES; stage++) error[i] += h * e[stage] * k[stage][i];
    }
    wrong = energy(error), size = energy(y);
    if (!(size < 1e300)) return 0;
    size = s->set[TOLERANCE] * (size + 1e-30);
    if (wrong <= size) {
      memcpy(s->y, y, sizeof s->y);
      memcpy(k[0], k[STAGES - 1], sizeof k[0]);
      s->time = last ? until : s->time + h;
    }
    h *= wrong > 0.0 ? fmin(fmax(0.9 * pow(size / wrong, 0.2), 0.2), 5.0) : 5.0;
    if (wrong > size && h < SMALLEST * fabs(until)) return 0;
    /* a step that was cut by the end of the communication step says nothing about the next one */
    if (!last || wrong > size || h > s->step) s->step = h;
  }
  s->time = until;
  return 1;
}

/* where all but the motions without strain would rest at this phase */
static void rest(State *s) {
  double w[4], u[INPUTS + 1], g[MESHES], sum;
  int i, j, c, first;
  memset(s->y, 0, sizeof s->y);
  first = weights(phase_of(s, s->y), w);
  for (c = 0; c < LOAD_COUNT; c++) u[c] = s->set[LOADS + c];
  for (c = LOAD_COUNT; c < INPUTS; c++) u[c] = between(friction_table[c - LOAD_COUNT], first, w);
  for (j = 0; j < MESHES; j++) {
    first = weights(phase_of_mesh(j, phase_of(s, s->y)), w);
    g[j] = between(force_table[j], first, w) - mesh_stiffness[j] * between(deflection_table[j], first, w);
  }
  for (i = RIGID; i < MODES; i++) {
    sum = 0.0;
    for (j = 0; j < MESHES; j++) sum -= mesh_rows[j][i] * g[j];
    for (c = 0; c < INPUTS; c++) sum += input_rows[c][i] * u[c];
    s->y[1 + i] = sum / (omega[i] * omega[i]);
  }
  s->step = 0.0, s->known = 0;
}

static int observe(State *s) {
  double u[INPUTS + 1], x[MESHES], f[MESHES], g[MESHES], seen[OUTPUTS], sum;
  int i, j, c, p, n, rotation = 0, shaken = 0;
  if (s->known) return 1;
  if (!meshes(s, s->y, u, x, f, g)) return 0;
  memcpy(s->value, s->set, sizeof s->set);
  s->value[PHASE] = phase_of(s, s->y);
  for (j = 0; j < MESHES; j++) s->value[DEFLECTIONS + j] = x[j], s->value[FORCES + j] = f[j];
  for (p = 0; p < OUTPUTS; p++) {
    sum = 0.0;
    for (i = 0; i < MODES; i++) sum += output_rows[p][i] * s->y[1 + i];
    for (j = 0; j < MESHES; j++) sum -= output_by_mesh[p][j] * g[j];
    for (c = 0; c < INPUTS; c++) sum += output_by_input[p][c] * u[c];
    seen[p] = sum;
    if (p < SHOWN) s->value[SEEN + p] = sum;
    if (shakes[p]) {
      sum = 0.0;
      for (i = 0; i < MODES; i++) sum += output_rows[p][i] * modal_acceleration(s, s->y, u, g, i);
      s->value[SHAKEN + shaken++] = sum;
    }
    if (!turns[p]) continue;
    s->value[SEEN + p] += ratio[p] * s->y[0];
    sum = ratio[p] * s->set[SPEED];
    for (i = 0; i < MODES; i++) sum += output_rows[p][i] * s->y[1 + MODES + i];
    s->value[RATES + rotation++] = sum;
  }
  if (SENSORS) {
    double angle = SENSOR_ANGLE - CARRIER * turned(s->y);
    const double *wave = seen + SHOWN; /* a_0, a_1, b_1, a_2, ... */
    sum = wave[0];
    for (n = 1; n <= DIAMETERS; n++) sum += wave[2 * n - 1] * cos(n * angle) + wave[2 * n] * sin(n * angle);
    s->value[VARIABLES - 1] = sum;
  }
  s->known = 1;
  return 1;
}

/* a new instance at rest */
static void begin(Instance *instance, const char *name) {
  if (name) strncpy(instance->name, name, sizeof instance->name - 1);
  memcpy(instance->state.set, start_values, sizeof instance->state.set);
  rest(&instance->state);
}

EXPORT const char *NAME(fmi2GetTypesPlatform)(void) { return "default"; }
EXPORT const char *NAME(fmi2GetVersion)(void) { return "2.0"; }

EXPORT fmi2Status NAME(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
  (void)c, (void)on, (void)n, (void)names;
  return fmi2OK;
}

EXPORT fmi2Component NAME(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                           const fmi2CallbackFunctions *calls, fmi2Boolean visible, fmi2Boolean logging) {
  Instance *instance;
  (void)resources, (void)visible, (void)logging;
  if (type != fmi2CoSimulation || !guid || strcmp(guid, GUID)) return NULL;
  instance = (Instance *)calloc(1, sizeof(Instance));
  if (!instance) return NULL;
  if (calls) instance->calls = *calls;
  begin(instance, name);
  return instance;
}

EXPORT void NAME(fmi2FreeInstance)(fmi2Component c) { free(c); }

EXPORT fmi2Status NAME(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean limited, fmi2Real tolerance, fmi2Real start,
                                            fmi2Boolean ends, fmi2Real stop) {
  (void)limited, (void)tolerance, (void)ends, (void)stop;
  ((Instance *)c)->state.time = start;
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2EnterInitializationMode)(fmi2Component c) {
  (void)c;
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2ExitInitializationMode)(fmi2Component c) {
  ((Instance *)c)->state.begun = 1;
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2Terminate)(fmi2Component c) {
  (void)c;
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2Reset)(fmi2Component c) {
  Instance *instance = (Instance *)c;
  memset(&instance->state, 0, sizeof instance->state);
  begin(instance, NULL);
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2GetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
  State *s = &((Instance *)c)->state;
  size_t i;
  for (i = 0; i < n; i++) {
    if (vr[i] >= VARIABLES) return fmi2Error;
    if (vr[i] < PHASE) {
      value[i] = s->set[vr[i]];
      continue;
    }
    if (!observe(s)) {
      say((Instance *)c, fmi2Error, "the mesh forces have no solution");
      return fmi2Error;
    }
    value[i] = s->value[vr[i]];
  }
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2SetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
  Instance *instance = (Instance *)c;
  State *s = &instance->state;
  size_t i;
  for (i = 0; i < n; i++) {
    int number = (int)vr[i];
    if (vr[i] >= PHASE || !(fabs(value[i]) < 1e300) || (number == DAMPING && value[i] < 0.0) ||
        (number == TOLERANCE && !(value[i] > 0.0 && value[i] < 1.0))) {
      say(instance, fmi2Error, "a value that is not allowed, or of a variable that is an output");
      return fmi2Error;
    }
    s->set[number] = value[i];
    s->known = 0;
  }
  if (!s->begun) rest(s);
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2DoStep)(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean kept) {
  Instance *instance = (Instance *)c;
  (void)kept;
  instance->state.known = 0;
  instance->state.time = time;
  if (size < 0.0 || !advance(instance, time + size)) {
    say(instance, fmi2Error, "the integration ended: the motion grows beyond all bounds, or has no solution");
    return fmi2Error;
  }
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *copy) {
  if (!*copy) *copy = malloc(sizeof(State));
  if (!*copy) return fmi2Error;
  memcpy(*copy, &((Instance *)c)->state, sizeof(State));
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate copy) {
  memcpy(&((Instance *)c)->state, copy, sizeof(State));
  return fmi2OK;
}

EXPORT fmi2Status NAME(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *copy) {
  (void)c;
  free(*copy);
  *copy = NULL;
  return fmi2OK;
}

/* what the description says that this unit has not */
#define REFUSED(name, ...)                                                       \
  EXPORT fmi2Status NAME(name)(fmi2Component c, __VA_ARGS__) {                     \
    say((Instance *)c, fmi2Error, #name " is none of the abilities of this unit"); \
    return fmi2Error;                                                            \
  }
REFUSED(fmi2GetInteger, const fmi2ValueReference vr[], size_t n, fmi2Integer value[])
REFUSED(fmi2GetBoolean, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[])
REFUSED(fmi2GetString, const fmi2ValueReference vr[], size_t n, fmi2String value[])
REFUSED(fmi2SetInteger, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[])
REFUSED(fmi2SetBoolean, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[])
REFUSED(fmi2SetString, const fmi2ValueReference vr[], size_t n, const fmi2String value[])
REFUSED(fmi2SerializedFMUstateSize, fmi2FMUstate state, size_t *size)
REFUSED(fmi2SerializeFMUstate, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
REFUSED(fmi2DeSerializeFMUstate, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
REFUSED(fmi2GetDirectionalDerivative, const fmi2ValueReference z[], size_t nz, const fmi2ValueReference v[], size_t nv,
        const fmi2Real dv[], fmi2Real dz[])
REFUSED(fmi2SetRealInputDerivatives, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
        const fmi2Real value[])
REFUSED(fmi2GetRealOutputDerivatives, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
        fmi2Real value[])
REFUSED(fmi2GetStatus, const fmi2StatusKind kind, fmi2Status *value)
REFUSED(fmi2GetRealStatus, const fmi2StatusKind kind, fmi2Real *value)
REFUSED(fmi2GetIntegerStatus, const fmi2StatusKind kind, fmi2Integer *value)
REFUSED(fmi2GetBooleanStatus, const fmi2StatusKind kind, fmi2Boolean *value)
REFUSED(fmi2GetStringStatus, const fmi2StatusKind kind, fmi2String *value)

EXPORT fmi2Status NAME(fmi2CancelStep)(fmi2Component c) {
  (void)c;
  return fmi2Error;
}
