/** @file scene_keys.c
 * The table of all scene keys, one row a key. The parser, its messages, the resolved scene, help and docs/scene.md
 * follow it.
 */
#include "scene_keys.h"

#define AT(type, field)           .offset = offsetof(type, field)
#define MANY(type, number, field) .count = offsetof(type, number), .offset = offsetof(type, field)
#define RANGE(from, to)           .low = (from), .high = (to)
#define POSITIVE                  .flags = KEY_OPEN_LOW, .low = 0, .high = HUGE_VAL
#define NOT_NEGATIVE              .low = 0, .high = HUGE_VAL
#define ONLY(kind)                (1u << (kind))
#define TABLE(name_, what_, type, selector_)                                                                           \
    static const silt_key_table name_##_table = {what_, sizeof(type), name_##_rows, selector_, false}

static const silt_word scheme_words[] = {{"implicit", SCHEME_IMPLICIT}, {"fractional", SCHEME_FRACTIONAL}, {0}};
static const silt_word pressure_words[] = {{"consistent", PRESSURE_CONSISTENT}, {"laplacian", PRESSURE_LAPLACIAN}, {0}};
static const silt_word condition_words[] = {
    {"no-slip", WALL_NO_SLIP}, {"slip", WALL_SLIP}, {"wall-law", WALL_LAW}, {0}};
static const silt_word wall_condition_words[] = {
    {"default", WALL_DEFAULT}, {"no-slip", WALL_NO_SLIP}, {"slip", WALL_SLIP}, {"wall-law", WALL_LAW}, {0}};
static const silt_word flow_words[] = {{"turbulent", FLOW_TURBULENT}, {"laminar", FLOW_LAMINAR}, {0}};
static const silt_word turbulence_words[] = {{"auto", TURBULENCE_AUTO},
                                             {"none", TURBULENCE_NONE},
                                             {"mixing-length", TURBULENCE_MIXING_LENGTH},
                                             {"smagorinsky", TURBULENCE_SMAGORINSKY},
                                             {"wale", TURBULENCE_WALE},
                                             {"spalart-allmaras", TURBULENCE_SPALART_ALLMARAS},
                                             {0}};
static const silt_word rheology_words[] = {{"newtonian", RHEOLOGY_NEWTONIAN},
                                           {"bingham", RHEOLOGY_BINGHAM},
                                           {"herschel-bulkley", RHEOLOGY_HERSCHEL_BULKLEY},
                                           {0}};
static const silt_word near_words[] = {{"region", NEAR_REGION}, {"walls", NEAR_WALLS},     {"bed", NEAR_BED},
                                       {"bodies", NEAR_BODIES}, {"surface", NEAR_SURFACE}, {0}};
static const silt_word axis_words[] = {{"none", 0}, {"x", 1}, {"y", 2}, {"z", 3}, {0}};
static const silt_word law_words[] = {{"frictional-work", BED_FRICTIONAL_WORK}, {"dissipation", BED_DISSIPATION},
                                      {"power", BED_POWER}, {"excess-shear", BED_EXCESS_SHEAR},
                                      {"shields", BED_SHIELDS}, {0}};
static const silt_word shear_words[] = {{"default", SHEAR_DEFAULT}, {"paper", SHEAR_PAPER}, {"gradient", SHEAR_GRADIENT},
                                        {"log-law", SHEAR_LOG_LAW}, {0}};
static const silt_word deposit_words[] = {{"grow", 0}, {"densify", 1}, {0}};
static const silt_word seepage_words[] = {
    {"none", SEEPAGE_NONE}, {"darcy", SEEPAGE_DARCY}, {"kozeny-carman", SEEPAGE_KOZENY_CARMAN}, {0}};
static const silt_word drag_words[] = {
    {"none", DRAG_NONE},       {"stokes", DRAG_STOKES},         {"schiller-naumann", DRAG_SCHILLER_NAUMANN}, {"abraham", DRAG_ABRAHAM},
    {"di-felice", DRAG_DI_FELICE}, {"ergun", DRAG_ERGUN},       {"wen-yu", DRAG_WEN_YU},
    {"gidaspow", DRAG_GIDASPOW}, {"koch-hill", DRAG_KOCH_HILL}, {"beetstra", DRAG_BEETSTRA}, {0}};
static const silt_word arrange_words[] = {{"random", ARRANGE_RANDOM}, {"lattice", ARRANGE_LATTICE}, {0}};
static const silt_word lift_words[] = {{"none", LIFT_NONE}, {"saffman", LIFT_SAFFMAN}, {0}};
static const silt_word shape_words[] = {
    {"box", SHAPE_BOX},           {"disc", SHAPE_DISC},       {"polygon", SHAPE_POLYGON}, {"temple", SHAPE_TEMPLE},     {"sphere", SHAPE_SPHERE},
    {"cylinder", SHAPE_CYLINDER}, {"capsule", SHAPE_CAPSULE}, {"wedge", SHAPE_WEDGE},     {"tetrapod", SHAPE_TETRAPOD}, {"surface", SHAPE_SURFACE},
    {0}};
static const silt_word motion_words[] = {
    {"free", MOTION_FREE}, {"fixed", MOTION_FIXED}, {"prescribed", MOTION_PRESCRIBED}, {0}};
static const silt_word held_words[] = {{"x", HELD_X}, {"y", HELD_Y}, {"z", HELD_Z}, {"angle", HELD_ANGLE}, {0}};
static const silt_word baseline_words[] = {
    {"none", BASELINE_NONE}, {"velocity", BASELINE_VELOCITY}, {"place", BASELINE_PLACE}, {0}};
static const silt_word front_words[] = {{"x", 1}, {"-x", -1}, {0}};
static const silt_word norm_words[] = {{"l2", NORM_L2}, {"max", NORM_MAX}, {"mean", NORM_MEAN}, {0}};
static const silt_word scalar_words[] = {{"none", SCALAR_NONE},
                                         {"max", SCALAR_MAX},
                                         {"min", SCALAR_MIN},
                                         {"last", SCALAR_LAST},
                                         {"mean", SCALAR_MEAN},
                                         {"period", SCALAR_PERIOD},
                                         {"slope", SCALAR_SLOPE},
                                         {"at", SCALAR_AT},
                                         {"reaches", SCALAR_REACHES},
                                         {"amplitude", SCALAR_AMPLITUDE},
                                         {"decay", SCALAR_DECAY},
                                         {0}};
static const silt_word extent_words[] = {{"x", 0}, {"y", 1}, {"z", 2}, {0}};
static const silt_word water_words[] = {{"water", 1}, {0}};
static const silt_word check_profile_words[] = {{"surface", PROFILE_SURFACE},
                                          {"velocity_x", PROFILE_VELOCITY_X},
                                          {"velocity_y", PROFILE_VELOCITY_Y},
                                          {"velocity_z", PROFILE_VELOCITY_Z},
                                          {"speed", PROFILE_SPEED},
                                          {"pressure", PROFILE_PRESSURE},
                                          {"grains", PROFILE_GRAINS},
                                          {0}};
static const silt_word formula_words[] = {{"uniform", FORMULA_UNIFORM},
                                          {"solid-rotation", FORMULA_SOLID_ROTATION},
                                          {"shear", FORMULA_SHEAR},
                                          {"strain", FORMULA_STRAIN},
                                          {"taylor-green", FORMULA_TAYLOR_GREEN},
                                          {"standing-wave", FORMULA_STANDING_WAVE},
                                          {"solitary-wave", FORMULA_SOLITARY_WAVE},
                                          {"field", FORMULA_FIELD},
                                          {0}};
static const silt_word wave_words[] = {{"boussinesq", WAVE_BOUSSINESQ}, {"grimshaw", WAVE_GRIMSHAW}, {0}};
static const silt_word force_words[] = {{"uniform", FORMULA_UNIFORM}, {"solid-rotation", FORMULA_SOLID_ROTATION},
                                        {"central", FORMULA_CENTRAL}, {"series", FORMULA_SERIES},
                                        {"field", FORMULA_FIELD},     {0}};

static const silt_key time_rows[] = {
    {"end", KEY_NUMBER, .unit = "s", POSITIVE, AT(silt_scene, time.end), .doc = "simulated time"},
    {"output", KEY_NUMBER, .unit = "s", POSITIVE, AT(silt_scene, time.output), .doc = "time between frames"},
    {"step", KEY_NUMBER, .unit = "s", .fallback = "0", NOT_NEGATIVE, AT(silt_scene, time.step),
     .doc = "largest step; 0: no limit of its own"},
    {"cfl", KEY_NUMBER, .fallback = "0.5", .flags = KEY_OPEN_LOW, RANGE(0, 1), AT(silt_scene, time.cfl),
     .doc = "share of a cell that a node may cross in a step"},
    {"checkpoint", KEY_NUMBER, .unit = "s", .fallback = "0", NOT_NEGATIVE, AT(silt_scene, time.checkpoint),
     .doc = "time between checkpoints; 0: ten outputs"},
    {"wall", KEY_NUMBER, .unit = "s", .fallback = "0", NOT_NEGATIVE, AT(silt_scene, time.wall),
     .doc = "seconds of the wall's clock after which a process stops with a checkpoint and exit code 3, as after SIGTERM; 0: no limit"},
    {"steps", KEY_LONG, .fallback = "0", RANGE(0, 1e15), AT(silt_scene, time.steps), .doc = "most steps; 0: no limit"},
    {"retries", KEY_INTEGER, .fallback = "8", RANGE(0, 30), AT(silt_scene, time.retries),
     .doc = "how often a failed step is halved"},
    {0}};
TABLE(time, "the time block", silt_scene, -1);

static const silt_key bounds_rows[] = {
    {"volume", KEY_NUMBER, .fallback = BOUNDS_VOLUME, POSITIVE, AT(silt_scene, bounds.volume),
     .doc = "largest `volume_error` of the water, what is owed included"},
    {"mass", KEY_NUMBER, .fallback = BOUNDS_MASS, POSITIVE, AT(silt_scene, bounds.mass),
     .doc = "the same without what is owed: water that is really lost or gained, as a share of start and inflow"},
    {"energy", KEY_NUMBER, .fallback = BOUNDS_ENERGY, POSITIVE, AT(silt_scene, bounds.energy),
     .doc = "largest energy of water, grains and bodies above that of the start and the work from outside, as a share of what could move"},
    {0}};
TABLE(bounds, "the bounds block", silt_scene, -1);

// regions stand in lists of their own, and in the items of fluid.sizes
#define REGION_ROWS(type, at)                                                                                          \
    {"box",                                                                                                            \
     KEY_BOX,                                                                                                          \
     .unit = "m",                                                                                                      \
     .flags = KEY_CHOICE,                                                                                              \
     .select = REGION_BOX,                                                                                             \
     AT(type, at lo),                                                                                                  \
     .doc = "two opposite corners, the lower left one first"},                                                         \
        {"polygon",                                                                                                    \
         KEY_POLYGON,                                                                                                  \
         .unit = "m",                                                                                                  \
         .flags = KEY_CHOICE,                                                                                          \
         .select = REGION_POLYGON,                                                                                     \
         MANY(type, at n_point, at point),                                                                             \
         .presence = ABSENT_TEXT,                                                                                      \
         .present = offsetof(type, at outline),                                                                        \
         .doc = "corners in either sense; it closes by itself; in 3-D corners [x, z] of an upright prism"},            \
        {"outline",                                                                                                    \
         KEY_FILE,                                                                                                     \
         .flags = KEY_CHOICE,                                                                                          \
         .select = REGION_POLYGON,                                                                                     \
         AT(type, at outline),                                                                                         \
         .doc = "CSV file beside the scene with the polygon's corners, columns x, y (3-D: x, z)"},                     \
        {"circle",                                                                                                     \
         KEY_POINT,                                                                                                    \
         .unit = "m",                                                                                                  \
         .flags = KEY_CHOICE | KEY_PLANE,                                                                              \
         .select = REGION_CIRCLE,                                                                                      \
         AT(type, at centre),                                                                                          \
         .doc = "centre of a circle"},                                                                                 \
        {"sphere",                                                                                                     \
         KEY_POINT,                                                                                                    \
         .unit = "m",                                                                                                  \
         .flags = KEY_CHOICE | KEY_SPACE,                                                                              \
         .select = REGION_SPHERE,                                                                                      \
         AT(type, at centre),                                                                                          \
         .doc = "centre of a sphere"},                                                                                 \
        {"radius",                                                                                                     \
         KEY_NUMBER,                                                                                                   \
         .unit = "m",                                                                                                  \
         POSITIVE,                                                                                                     \
         .when = ONLY(REGION_CIRCLE) | ONLY(REGION_SPHERE),                                                            \
         AT(type, at radius),                                                                                          \
         .doc = "of the circle or sphere"},                                                                            \
    {                                                                                                                  \
        "across", KEY_ACROSS, .unit = "m", .flags = KEY_SPACE, .when = ONLY(REGION_POLYGON), AT(type, at lo),          \
                              .doc = "from which y to which y the polygon's prism reaches"                             \
    }

static const silt_key region_rows[] = {REGION_ROWS(silt_region, ), {0}};
TABLE(region, "a region", silt_region, offsetof(silt_region, kind));

#define CORNERS \
    "of a flat, convex polygon, in a wall or in the open; counter-clockwise as the water in front of it sees them"
#define EDDY_ROWS(type, where)                                                                                                               \
    {"eddy_viscosity", KEY_NUMBER, .unit = "m2/s", .fallback = "0", NOT_NEGATIVE, AT(type, eddy.viscosity),                                \
     .doc = "with turbulence: spalart-allmaras, of the water " where "; 0: by shear_velocity, or without it 3 viscosity/density"},         \
    {"shear_velocity", KEY_NUMBER, .unit = "m/s", .fallback = "0", NOT_NEGATIVE, AT(type, eddy.shear),                                     \
     .doc = "with turbulence: spalart-allmaras, of a log law " where ": eddy viscosity 0.41 u* d (1 - d/D), d the distance to the nearest wall, "\
            "D the depth"}
static const silt_key inlet_rows[] = {
    {"name", KEY_NAME, AT(silt_inlet, name), .doc = "different from all other inlets and outlets"},
    {"from", KEY_POINT, .unit = "m", .flags = KEY_PLANE, AT(silt_inlet, from),
     .doc = "start of the segment, the water on its left"},
    {"to", KEY_POINT, .unit = "m", .flags = KEY_PLANE, AT(silt_inlet, to), .doc = "end of the segment"},
    {"corners", KEY_CORNERS, .unit = "m", .flags = KEY_SPACE, MANY(silt_inlet, n_corner, corner), .doc = CORNERS},
    {"velocity", KEY_POINT, .unit = "m/s", .flags = KEY_CHOICE, .select = INLET_VELOCITY, AT(silt_inlet, velocity),
     .doc = "of the water that comes in"},
    {"head", KEY_CURVE, .unit = "m", .flags = KEY_CHOICE, .select = INLET_HEAD, AT(silt_inlet, head),
     .doc = "level of still water behind the inlet, whose pressure drives the water in, less rho u^2/2 for the speed that it comes "
            "in with: a number, or a CSV file beside the scene with time in s, level in m"},
    {"series", KEY_SERIES, .flags = KEY_OPTIONAL, .when = ONLY(INLET_VELOCITY), AT(silt_inlet, series),
     .doc = "CSV file beside the scene: time in s, factor on the velocity"},
    {"grains", KEY_NUMBER, .unit = "kg/s", .fallback = "0", NOT_NEGATIVE, .when = ONLY(INLET_VELOCITY), AT(silt_inlet, grains),
     .doc = "sediment that comes in with the water (2-D: kg/s per m of width), times the factor of `series`: parcels of grains.parcel "
            "with bed.density, at random places of the inlet; needs a bed"},
    EDDY_ROWS(silt_inlet, "that comes in"),
    {0}};
TABLE(inlet, "an inlet", silt_inlet, offsetof(silt_inlet, drive));

static const silt_key outlet_rows[] = {
    {"name", KEY_NAME, AT(silt_outlet, name), .doc = "different from all other inlets and outlets"},
    {"from", KEY_POINT, .unit = "m", .flags = KEY_PLANE, AT(silt_outlet, from), .doc = "start of the segment"},
    {"to", KEY_POINT, .unit = "m", .flags = KEY_PLANE, AT(silt_outlet, to),
     .doc = "end of the segment; what crosses it from its left to its right leaves"},
    {"corners", KEY_CORNERS, .unit = "m", .flags = KEY_SPACE, MANY(silt_outlet, n_corner, corner), .doc = CORNERS},
    {"level", KEY_CURVE, .unit = "m", .flags = KEY_OPTIONAL, AT(silt_outlet, level),
     .doc = "of the water behind it, whose pressure acts on it: a number, or a CSV file beside the scene with time in s, level in "
            "m; without it the water falls out freely"},
    {0}};
TABLE(outlet, "an outlet", silt_outlet, -1);

enum {
    FORMULA_WITH_RATE = ONLY(FORMULA_SOLID_ROTATION) | ONLY(FORMULA_SHEAR) | ONLY(FORMULA_STRAIN),
    FORMULA_WITH_LENGTH = ONLY(FORMULA_TAYLOR_GREEN) | ONLY(FORMULA_STANDING_WAVE),
    FORMULA_WITH_DEPTH = ONLY(FORMULA_STANDING_WAVE) | ONLY(FORMULA_SOLITARY_WAVE),
};
static const silt_key formula_rows[] = {
    {"formula", KEY_WORD, .flags = KEY_SELECTOR, .words = formula_words, AT(silt_formula, kind),
     .doc = "named velocity field at the start, in 3-D in the plane x-z"},
    {"vector", KEY_POINT, .unit = "m/s", .fallback = "[0, 0]", AT(silt_formula, vector),
     .doc = "added to what the formula gives; with uniform it is all"},
    {"rate", KEY_NUMBER, .unit = "1/s", .when = FORMULA_WITH_RATE, AT(silt_formula, rate),
     .doc = "angular velocity, shear u = rate y, or strain u = -rate x, v = rate y, about the centre"},
    {"axis", KEY_WORD, .fallback = "z", .flags = KEY_SPACE, .words = axis_words + 1,
     .when = ONLY(FORMULA_SOLID_ROTATION), AT(silt_formula, axis), .doc = "what the rotation is right-handed about"},
    {"amplitude", KEY_NUMBER, .unit = "m/s or m", .when = FORMULA_WITH_LENGTH | ONLY(FORMULA_SOLITARY_WAVE),
     AT(silt_formula, amplitude),
     .doc = "largest velocity of the Taylor-Green cell, height of the wave over still water"},
    {"length", KEY_NUMBER, .unit = "m", POSITIVE, .when = FORMULA_WITH_LENGTH, AT(silt_formula, length),
     .doc = "width of the Taylor-Green cell, wavelength of the standing wave"},
    {"depth", KEY_NUMBER, .unit = "m", POSITIVE, .when = FORMULA_WITH_DEPTH, AT(silt_formula, depth),
     .doc = "of the still water under the wave"},
    {"profile", KEY_WORD, .fallback = "grimshaw", .words = wave_words, .when = ONLY(FORMULA_SOLITARY_WAVE),
     AT(silt_formula, profile),
     .doc = "of the solitary wave: amplitude times sech^2(k x), k^2 = 0.75 amplitude/depth^3, or to third order in "
            "amplitude/depth; the surface itself is given by a region, see outline"},
    {"direction", KEY_SIGN, .fallback = "x", .words = front_words, .when = ONLY(FORMULA_SOLITARY_WAVE),
     AT(silt_formula, rate), .doc = "where the solitary wave runs"},
    {"centre", KEY_POINT, .unit = "m", .fallback = "[0, 0]",
     .when = FORMULA_WITH_RATE | FORMULA_WITH_LENGTH | FORMULA_WITH_DEPTH, AT(silt_formula, centre),
     .doc = "centre; corner of the Taylor-Green cell; bed below the first crest of the wave"},
    {"file", KEY_TABLE, .when = ONLY(FORMULA_FIELD), AT(silt_formula, series),
     .doc = "CSV file beside the scene: points and velocities, columns x, y, vx, vy (3-D: z, vz too), linear between "
            "them"},
    {0}};
TABLE(formula, "an initial velocity", silt_formula, offsetof(silt_formula, kind));

enum { FORCE_WITH_RATE = ONLY(FORMULA_SOLID_ROTATION) | ONLY(FORMULA_CENTRAL) };
static const silt_key force_rows[] = {
    {"formula", KEY_WORD, .flags = KEY_SELECTOR, .words = force_words, AT(silt_formula, kind),
     .doc = "named field of acceleration"},
    {"vector", KEY_POINT, .unit = "m/s2", .fallback = "[0, 0]", AT(silt_formula, vector),
     .doc = "added to what the formula gives; with uniform it is all"},
    {"rate", KEY_NUMBER, .unit = "1/s2 or 1/s", .when = FORCE_WITH_RATE, AT(silt_formula, rate),
     .doc = "angular acceleration of the rotation; central: -rate |rate| (x - centre), so a negative rate drives "
            "outwards"},
    {"axis", KEY_WORD, .fallback = "none", .flags = KEY_SPACE, .words = axis_words, .when = FORCE_WITH_RATE,
     AT(silt_formula, axis), .doc = "what it turns or is central about; none: the point, for a rotation z"},
    {"centre", KEY_POINT, .unit = "m", .fallback = "[0, 0]", .when = FORCE_WITH_RATE, AT(silt_formula, centre),
     .doc = "where it is zero"},
    {"file", KEY_TABLE, .when = ONLY(FORMULA_FIELD) | ONLY(FORMULA_SERIES), AT(silt_formula, series),
     .doc = "CSV file beside the scene; series: time, x, y (3-D: z too), the same everywhere; field: points and "
            "accelerations, columns x, y, vx, vy (3-D: z, vz too)"},
    {0}};
TABLE(force, "a body force", silt_formula, offsetof(silt_formula, kind));

static const silt_key size_rows[] = {
    {"near", KEY_WORD, .fallback = "region", .words = near_words, AT(silt_size_def, near),
     .doc = "what the size belongs to: a region given here, walls, bed, bodies, the free surface"},
    {"size", KEY_NUMBER, .unit = "m", POSITIVE, AT(silt_size_def, size), .doc = "distance between nodes there"},
    {"distance", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_size_def, distance),
     .doc = "how far around it the size holds"},
    REGION_ROWS(silt_size_def, region.),
    {0}};
static const silt_key_table size_table = {"a size of nodes", sizeof(silt_size_def), size_rows,
                                          offsetof(silt_size_def, region.kind), true};

static const silt_key fluid_rows[] = {
    {"density", KEY_NUMBER, .unit = "kg/m3", POSITIVE, AT(silt_fluid_def, density), .doc = "of the water"},
    {"viscosity", KEY_NUMBER, .unit = "Pa s", NOT_NEGATIVE, AT(silt_fluid_def, viscosity), .doc = "dynamic"},
    {"size", KEY_NUMBER, .unit = "m", POSITIVE, AT(silt_fluid_def, size), .doc = "distance h between nodes"},
    {"scheme", KEY_WORD, .fallback = "implicit", .words = scheme_words, AT(silt_fluid_def, scheme),
     .doc = "momentum step: viscosity implicit, or fractional step"},
    {"pressure", KEY_WORD, .fallback = "consistent", .words = pressure_words, AT(silt_fluid_def, pressure),
     .doc = "operator of the pressure step"},
    {"flow", KEY_WORD, .fallback = "turbulent", .words = flow_words, AT(silt_fluid_def, flow),
     .doc = "decides the defaults of turbulence and of the walls' condition"},
    {"turbulence", KEY_WORD, .fallback = "auto", .words = turbulence_words, AT(silt_fluid_def, turbulence),
     .doc = "model; auto: mixing-length in 2-D, wale in 3-D, none where the flow is laminar; spalart-allmaras: eddies that the water carries"},
    EDDY_ROWS(silt_fluid_def, "at the start"),
    {"wall_height", KEY_NUMBER, .unit = "h", .fallback = "2", .flags = KEY_OPEN_LOW, RANGE(0, 20),
     AT(silt_fluid_def, wall_height), .doc = "distance from the wall at which the wall law samples the velocity"},
    {"rheology", KEY_WORD, .fallback = "newtonian", .words = rheology_words, AT(silt_fluid_def, rheology),
     .doc = "stress over shear rate: proportional; with a yield stress; yield stress and a power law"},
    {"yield_stress", KEY_NUMBER, .unit = "Pa", .fallback = "0", NOT_NEGATIVE, AT(silt_fluid_def, yield_stress),
     .doc = "of rheology: bingham, herschel-bulkley"},
    {"flow_index", KEY_NUMBER, .fallback = "1", .flags = KEY_OPEN_LOW, RANGE(0, 3), AT(silt_fluid_def, flow_index),
     .doc = "n of rheology: herschel-bulkley, stress = yield_stress + viscosity rate^n; viscosity then in Pa s^n"},
    {"plastic_rate", KEY_NUMBER, .unit = "1/s", .fallback = "1e-3", POSITIVE, AT(silt_fluid_def, plastic_rate),
     .doc = "shear rate below which the yield stress is smoothed, so that the viscosity stays finite"},
    {"order", KEY_INTEGER, .fallback = "2", RANGE(1, 2), AT(silt_fluid_def, order),
     .doc = "in time: 2 trapezoidal, 1 backward Euler"},
    {"theta", KEY_NUMBER, .fallback = "0", RANGE(0, 1), AT(silt_fluid_def, theta),
     .doc = "implicitness of the step, 0.5 trapezoidal to 1 backward Euler; 0: what `order` says"},
    {"alpha", KEY_NUMBER, .unit = "h", .fallback = "1.3", .flags = KEY_OPEN_LOW, RANGE(0, 10),
     AT(silt_fluid_def, alpha), .doc = "largest circumradius of a cell that was water a step ago"},
    {"merge", KEY_NUMBER, .unit = "h", .fallback = "0.3", .flags = KEY_OPEN_LOW, RANGE(0, 10),
     AT(silt_fluid_def, merge), .doc = "width of a gap between two surfaces that closes and becomes water"},
    {"tolerance", KEY_NUMBER, .fallback = "1e-6", .flags = KEY_OPEN_LOW | KEY_OPEN_HIGH, RANGE(0, 1),
     AT(silt_fluid_def, tolerance), .doc = "relative residual of the continuity equation"},
    {"iterations", KEY_INTEGER, .fallback = "12", RANGE(1, 10000), AT(silt_fluid_def, iterations),
     .doc = "most iterations of a step"},
    {"volume_control", KEY_SWITCH, .fallback = "true", AT(silt_fluid_def, volume_control),
     .doc = "give back the volume that reconnecting created or lost"},
    {"volume_steps", KEY_NUMBER, .unit = "steps", .fallback = "15", RANGE(1, 1e6), AT(silt_fluid_def, volume_steps),
     .doc = "over how many steps it is given back"},
    {"volume_time", KEY_NUMBER, .unit = "s", .fallback = "0", NOT_NEGATIVE, AT(silt_fluid_def, volume_time),
     .doc = "and over what time at least; 0: twice the time sqrt(size/g)"},
    {"jitter", KEY_NUMBER, .unit = "h", .fallback = "0", RANGE(0, 0.5), AT(silt_fluid_def, jitter),
     .doc = "random shift of the first nodes inside the water"},
    {"seed", KEY_INTEGER, .fallback = "1", RANGE(0, INT32_MAX), AT(silt_fluid_def, seed), .doc = "of that shift"},
    {"regions", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &region_table, MANY(silt_fluid_def, n_region, region),
     .doc = "where water is at the start"},
    {"cloud", KEY_FILE, .flags = KEY_OPTIONAL, AT(silt_fluid_def, cloud),
     .doc = "CSV file beside the scene with the first nodes of the water, columns x, y (3-D: z too), and vx, vy (vz) "
            "if it "
            "gives velocities; without it they stand regularly"},
    {"shuffle", KEY_NUMBER, .unit = "h", .fallback = "0", RANGE(0, 0.5), AT(silt_fluid_def, shuffle),
     .doc = "random shift of the nodes inside the water in every step: a test of remeshing"},
    {"sizes", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &size_table, MANY(silt_fluid_def, n_size, size_at),
     .doc = "where nodes stand closer or farther than `size`; the smallest counts"},
    {"size_growth", KEY_NUMBER, .fallback = "0.3", .flags = KEY_OPEN_LOW, RANGE(0, 10), AT(silt_fluid_def, size_growth),
     .doc = "largest change of the size per distance"},
    {"air_pressure", KEY_NUMBER, .unit = "Pa", .fallback = "0", NOT_NEGATIVE, AT(silt_fluid_def, air_pressure),
     .doc = "absolute, of the air that closed pockets hold when they close; 0: pockets have no pressure"},
    {"air_exponent", KEY_NUMBER, .fallback = "1.4", RANGE(1, 2), AT(silt_fluid_def, air_exponent),
     .doc = "of its compression; 1: isothermal, 1.4: adiabatic"},
    {"surface_tension", KEY_NUMBER, .unit = "N/m", .fallback = "0", NOT_NEGATIVE, AT(silt_fluid_def, surface_tension),
     .doc = "of the free surface, 0.073 of water in air; walls are neutral: the surface meets them at a right angle"},
    {"body_force", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &force_table, .presence = PRESENT_WORD,
     .present = offsetof(silt_fluid_def, force.kind), AT(silt_fluid_def, force),
     .doc = "acceleration of the water besides gravity"},
    {"inlets", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &inlet_table, MANY(silt_fluid_def, n_inlet, inlet),
     .doc = "where water comes in"},
    {"outlets", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &outlet_table,
     MANY(silt_fluid_def, n_outlet, outlet), .doc = "where water and grains leave"},
    {"velocity", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &formula_table, .presence = PRESENT_WORD,
     .present = offsetof(silt_fluid_def, velocity.kind), AT(silt_fluid_def, velocity),
     .doc = "velocity at the start; at rest without it"},
    {0}};
TABLE(fluid, "the fluid block", silt_fluid_def, -1);

static const silt_key wall_rows[] = {
    {"polyline", KEY_CHAIN, .unit = "m", .flags = KEY_CHOICE | KEY_PLANE, .select = WALL_POLYLINE,
     MANY(silt_wall, n_point, point),
     .doc = "corners, the water on the left; a last point equal to the first closes it"},
    {"box", KEY_BOX, .unit = "m", .flags = KEY_CHOICE, .select = WALL_BOX, AT(silt_wall, lo),
     .doc = "closed box around the water, lower left corner first"},
    {"surface", KEY_SURFACE, .flags = KEY_CHOICE | KEY_SPACE, .select = WALL_SURFACE, AT(silt_wall, surface),
     .doc = "triangulated surface, normals into the water: STL or .msh; with libgmsh at the build also .msh of other versions, and "
            ".geo, .step, .brep, .iges, which it triangulates, normals out of closed shapes"},
    {"closed", KEY_SWITCH, .fallback = "false", .flags = KEY_PLANE, .when = ONLY(WALL_POLYLINE) | ONLY(WALL_BOX),
     AT(silt_wall, closed), .doc = "the last point is joined to the first"},
    {"scale", KEY_NUMBER, .fallback = "1", .flags = KEY_OPEN_LOW | KEY_SPACE, .low = 0, .high = HUGE_VAL,
     .when = ONLY(WALL_SURFACE), AT(silt_wall, scale), .doc = "what the file's coordinates are multiplied by to be m"},
    {"inside_out", KEY_SWITCH, .fallback = "false", .flags = KEY_SPACE, .when = ONLY(WALL_SURFACE),
     AT(silt_wall, inside_out), .doc = "the file's normals point out of the water"},
    {"condition", KEY_WORD, .fallback = "default", .words = wall_condition_words, AT(silt_wall, condition),
     .doc = "of the water at the wall; default: wall-law where fluid.flow is turbulent, no-slip where it is laminar"},
    {"roughness", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_wall, roughness),
     .doc = "equivalent sand roughness of the wall law; 0: smooth"},
    {"velocity", KEY_POINT, .unit = "m/s", .fallback = "[0, 0]", AT(silt_wall, velocity),
     .doc = "of the wall's surface along itself, which stays where it is: a lid, a belt"},
    {"motion", KEY_SERIES, .flags = KEY_OPTIONAL, AT(silt_wall, motion),
     .doc = "CSV file beside the scene: time in s, then any of x, y, z in m and angle in degrees from the place given here, columns by "
            "name; the angle turns from x to y (3-D: from x to z). In their place accelerations ax, ay, az in m/s2 and aangle in "
            "degrees/s2, as of an earthquake: linear between rows, integrated exactly from rest at the first row, none after the last"},
    {"motion_scale", KEY_NUMBER, .fallback = "1", AT(silt_wall, motion_scale),
     .doc = "factor on all columns of `motion` but time: 9.81 where a record is in g"},
    {"baseline", KEY_WORD, .fallback = "none", .words = baseline_words, AT(silt_wall, baseline),
     .doc = "what is taken off the accelerations of `motion`: nothing, a constant so that the last row is at rest, or a straight line over "
            "time so that it is at rest where it began"},
    {"pivot", KEY_POINT, .unit = "m", .fallback = "[0, 0]", AT(silt_wall, pivot), .doc = "what the angle turns about"},
    {0}};
TABLE(wall, "a wall", silt_wall, offsetof(silt_wall, form));

static const silt_key bed_rows[] = {
    {"density", KEY_NUMBER, .unit = "kg/m3", POSITIVE, AT(silt_bed_def, density), .doc = "of the grains' solid"},
    {"porosity", KEY_NUMBER, .flags = KEY_OPEN_HIGH, RANGE(0, 1), AT(silt_bed_def, porosity), .doc = "share of pores"},
    {"law", KEY_WORD, .flags = KEY_SELECTOR, .fallback = "frictional-work", .words = law_words, AT(silt_bed_def, law),
     .doc = "how fast the water wears the bed; see docs/bed.md"},
    {"work", KEY_NUMBER, .unit = "J/m3", .flags = KEY_INFINITE, RANGE(0, HUGE_VAL),
     AT(silt_bed_def, work), .when = ONLY(BED_FRICTIONAL_WORK) | ONLY(BED_DISSIPATION) | ONLY(BED_POWER),
     .doc = "W_c, frictional work that loosens the bed; 0: whatever water wears it, a layer a step; .inf: never. A constant of law, mesh and water, not of the soil: at a rate of "
            "E m/s under tau it is h_b tau^2/(viscosity E), h_b the patch height; power: (tau - threshold) u*/E"},
    {"erodibility", KEY_NUMBER, .unit = "m3/(N s)", POSITIVE, AT(silt_bed_def, erodibility), .when = ONLY(BED_EXCESS_SHEAR),
     .doc = "k_d of E = k_d (tau - threshold); Hanson and Simon: 2e-7 threshold^-0.5"},
    {"critical_shields", KEY_NUMBER, .fallback = "0", NOT_NEGATIVE, AT(silt_bed_def, critical), .when = ONLY(BED_SHIELDS),
     .doc = "Shields number at which grains begin to move; 0: Soulsby and Whitehouse for grains.diameter"},
    {"shear", KEY_WORD, .fallback = "default", .words = shear_words, AT(silt_bed_def, shear),
     .doc = "stress on the bed: viscosity v/(2 distance), viscosity times the gradient at the bed, or the law of a rough wall; default: "
            "paper for frictional-work, gradient for dissipation, log-law for the others"},
    {"distance", KEY_NUMBER, .unit = "m", .fallback = "=fluid.size", POSITIVE, AT(silt_bed_def, distance),
     .doc = "where shear: paper samples the velocity, along the normal"},
    {"roughness", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_bed_def, roughness),
     .doc = "equivalent sand roughness of the bed, for log-law and for condition: wall-law; 0: 2.5 grains.diameter"},
    {"size", KEY_NUMBER, .unit = "m", .fallback = "=fluid.size", POSITIVE, AT(silt_bed_def, size),
     .doc = "distance between the bed's nodes"},
    {"layer", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_bed_def, layer),
     .when = ONLY(BED_FRICTIONAL_WORK) | ONLY(BED_DISSIPATION),
     .doc = "thickness that one `work` removes; 0: the height of the patch"},
    {"threshold", KEY_NUMBER, .unit = "Pa", .fallback = "0", NOT_NEGATIVE, AT(silt_bed_def, threshold),
     .when = ONLY(BED_FRICTIONAL_WORK) | ONLY(BED_DISSIPATION) | ONLY(BED_POWER) | ONLY(BED_EXCESS_SHEAR),
     .doc = "shear stress below which nothing wears, on level ground"},
    {"repose", KEY_NUMBER, .unit = "degrees", .fallback = "0", .low = 0, .high = 80, AT(silt_bed_def, repose),
     .doc = "angle of repose: what stands steeper falls as grains; 0: it stands at any slope, but not upside down"},
    {"slope", KEY_SWITCH, .fallback = "true", AT(silt_bed_def, slope),
     .doc = "with repose, the threshold falls downhill and rises uphill"},
    {"cover", KEY_SWITCH, .fallback = "true", AT(silt_bed_def, cover),
     .doc = "the part of the bed that parcels lie on does not wear"},
    {"saturation", KEY_NUMBER, .fallback = "1", RANGE(0, 1), AT(silt_bed_def, saturation),
     .doc = "share of the pores that holds water"},
    {"seepage", KEY_WORD, .fallback = "none", .words = seepage_words, AT(silt_bed_def, seepage),
     .doc = "water in the bed's pores: none, by `permeability`, or by grains.diameter and the pores of each cell, d^2 n^3/(180 (1 - n)^2)"},
    {"permeability", KEY_NUMBER, .unit = "m2", .fallback = "0", NOT_NEGATIVE, AT(silt_bed_def, permeability),
     .doc = "for seepage: darcy; the hydraulic conductivity K in m/s is this times density g/viscosity"},
    {"fluidise", KEY_SWITCH, .fallback = "true", AT(silt_bed_def, fluidise),
     .doc = "seepage that outweighs the grains on the surface lifts them off"},
    {"deposition", KEY_SWITCH, .fallback = "true", AT(silt_bed_def, deposition),
     .doc = "resting grains become bed again"},
    {"deposit", KEY_WORD, .fallback = "grow", .words = deposit_words, AT(silt_bed_def, densify),
     .doc = "resting grains become new cells of the bed, or first fill cells that are looser than porosity"},
    {"deposit_work", KEY_NUMBER, .unit = "J/m3", .fallback = "0", NOT_NEGATIVE, AT(silt_bed_def, deposit_work),
     .when = ONLY(BED_FRICTIONAL_WORK) | ONLY(BED_DISSIPATION) | ONLY(BED_POWER),
     .doc = "`work` of what was deposited; 0: the same"},
    {"condition", KEY_WORD, .fallback = "no-slip", .words = condition_words, AT(silt_bed_def, condition),
     .doc = "of the water on the bed"},
    {"regions", KEY_LIST, .sub = &region_table, MANY(silt_bed_def, n_region, region),
     .doc = "where bed is at the start"},
    {0}};
TABLE(bed, "the bed block", silt_bed_def, offsetof(silt_bed_def, law));

static const silt_key grain_rows[] = {
    {"at", KEY_POINT, .unit = "m", AT(silt_grain_def, at), .doc = "centre"},
    {"velocity", KEY_POINT, .unit = "m/s", .fallback = "[0, 0]", AT(silt_grain_def, velocity), .doc = "at the start"},
    {"diameter", KEY_NUMBER, .unit = "m", POSITIVE, AT(silt_grain_def, diameter), .doc = "of this grain"},
    {"density", KEY_NUMBER, .unit = "kg/m3", POSITIVE, AT(silt_grain_def, density), .doc = "of its solid"},
    {"fixed", KEY_SWITCH, .fallback = "false", AT(silt_grain_def, fixed), .doc = "it is held where it is, at rest; others touch it"},
    {0}};
TABLE(grain, "a grain", silt_grain_def, -1);

static const silt_key fill_rows[] = {
    REGION_ROWS(silt_fill_def, region.),
    {"diameter", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_fill_def, diameter),
     .doc = "of its grains; 0: those of the sieve"},
    {"sieve", KEY_TABLE, .flags = KEY_OPTIONAL, AT(silt_fill_def, sieve),
     .doc = "CSV file beside the scene with the columns diameter in m and passing, the share of the mass that is finer, from 0 to 1, "
            "linear between rows"},
    {"density", KEY_NUMBER, .unit = "kg/m3", POSITIVE, AT(silt_fill_def, density), .doc = "of the grains' solid"},
    {"velocity", KEY_POINT, .unit = "m/s", .fallback = "[0, 0]", AT(silt_fill_def, velocity), .doc = "at the start"},
    {"porosity", KEY_NUMBER, .fallback = "0", .flags = KEY_OPEN_HIGH, RANGE(0, 1), AT(silt_fill_def, porosity),
     .doc = "share of the region's area, in 3-D of its volume, that is left between the grains; 0: as `count` says"},
    {"count", KEY_INTEGER, .fallback = "0", RANGE(0, SCENE_GRAINS), AT(silt_fill_def, count),
     .doc = "how many grains; 0: as the porosity says, and without it as many as the arrangement holds, random up to a share of 0.45 "
            "(3-D: 0.3)"},
    {"arrangement", KEY_WORD, .fallback = "random", .words = arrange_words, AT(silt_fill_def, arrangement),
     .doc = "random: one after the other anywhere, beyond a share of 0.45 (3-D: 0.3) shaken from a lattice; lattice: rows of triangles, "
            "from below; denser packings come by letting grains settle"},
    {"seed", KEY_INTEGER, .fallback = "1", RANGE(0, INT32_MAX), AT(silt_fill_def, seed),
     .doc = "of the random places: the same places for the same seed"},
    {"fixed", KEY_SWITCH, .fallback = "false", AT(silt_fill_def, fixed), .doc = "its grains are held where they are, at rest: a packed bed"},
    {0}};
TABLE(fill, "a region of grains", silt_fill_def, offsetof(silt_fill_def, region.kind));

static const silt_key grains_rows[] = {
    {"drag", KEY_WORD, .fallback = "di-felice", .words = drag_words, AT(silt_grains_def, drag), .doc = "drag law"},
    {"parcel", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_grains_def, parcel),
     .doc = "diameter of the elements that released bed becomes; needed with a bed"},
    {"per_patch", KEY_INTEGER, .fallback = "0", RANGE(0, 64), AT(silt_grains_def, per_patch),
     .doc = "how many parcels a patch of the bed becomes; 0: as many of the diameter parcel as make its mass"},
    {"sieve", KEY_TABLE, .flags = KEY_OPTIONAL, AT(silt_grains_def, sieve),
     .doc = "CSV file beside the scene: diameter in m, share of the mass that passes (from 0 to 1), columns diameter, passing; the diameters "
            "of the parcels, drawn by fluid.seed and node"},
    {"diameter", KEY_NUMBER, .unit = "m", .fallback = "=grains.parcel", NOT_NEGATIVE, AT(silt_grains_def, diameter),
     .doc = "of the grains that a parcel stands for, for the drag"},
    {"width", KEY_NUMBER, .unit = "m", .fallback = "0", .flags = KEY_PLANE, NOT_NEGATIVE, AT(silt_grains_def, width),
     .doc = "accounting width; 0: (2/3)(0.82) d/(1 - n) of the parcel; without a bed 0.91 d with regions (n = 0.4), else 5 d"},
    {"kernel", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_grains_def, kernel),
     .doc = "width of the porosity kernel; 0: the larger of 3 d and 2 h"},
    {"kernel_layers", KEY_SWITCH, .fallback = "false", AT(silt_grains_def, kernel_layers),
     .doc = "the kernel takes means along the whole of x (3-D: and y), in layers as thick as `kernel`: for level beds in periodic channels, whose "
            "water is the same along x (and y) in the mean and changes within a grain's height over the bed"},
    {"across", KEY_SWITCH, .fallback = "false", .flags = KEY_SPACE, AT(silt_grains_def, across),
     .doc = "grains that go through one end of the walls in y come in at the other: a channel without sides; the water keeps its own, which should "
            "be slip. Only with kernel_layers, whose means do not know where in y a grain is"},
    {"added_mass", KEY_NUMBER, .fallback = "0", NOT_NEGATIVE, AT(silt_grains_def, added_mass),
     .doc = "share of the displaced water that is accelerated along; spheres: 0.5"},
    {"lift", KEY_WORD, .fallback = "none", .words = lift_words, AT(silt_grains_def, lift), .doc = "force across the water's shear"},
    {"viscous_force", KEY_SWITCH, .fallback = "false", AT(silt_grains_def, viscous_force),
     .doc = "force of the water's viscous stress on the grain's volume"},
    {"rotational_drag", KEY_SWITCH, .fallback = "false", AT(silt_grains_def, rotational_drag),
     .doc = "torque of the water on grains that spin otherwise than it does"},
    {"eddy_limit", KEY_NUMBER, .fallback = "0", .flags = KEY_OPEN_HIGH, RANGE(0, 1), AT(silt_grains_def, eddy_limit),
     .doc = "share of grains in the water at which eddies have no room: the mixing length counts the way to the wall times 1 - share/limit "
            "(Li and Sawamoto 1995; 0.6); 0: grains do not hinder eddies"},
    {"gusts", KEY_NUMBER, .unit = "s", .fallback = "0", NOT_NEGATIVE, AT(silt_grains_def, gusts),
     .doc = "how long a gust lasts at a grain, such as the depth of a stream over its mean velocity: the eddies that the mesh does not show, added "
            "to the water's velocity in the drag (docs/grains.md); 0: none"},
    {"random_walk", KEY_SWITCH, .fallback = "false", AT(silt_grains_def, random_walk),
     .doc = "suspended grains wander with the eddies that the mesh does not show; random numbers by fluid.seed"},
    {"pick_up", KEY_SWITCH, .fallback = "false", AT(silt_grains_def, pick_up),
     .doc = "grains at rest walk too: what settles on the ground it gives back, as far as the eddies reach down to it"},
    {"schmidt", KEY_NUMBER, .fallback = "1", POSITIVE, AT(silt_grains_def, schmidt),
     .doc = "eddy viscosity over the diffusivity of that walk"},
    {"list", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &grain_table, MANY(silt_grains_def, n_grain, grain),
     .doc = "grains that are there from the start"},
    {"regions", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &fill_table, MANY(silt_grains_def, n_fill, fill),
     .doc = "what is full of grains at the start; they keep clear of walls, bed, bodies and other grains"},
    {0}};
TABLE(grains, "the grains block", silt_grains_def, -1);

static const silt_key contact_rows[] = {
    {"youngs_modulus", KEY_NUMBER, .unit = "Pa", RANGE(5e6, 1e12), AT(silt_contact_def, youngs_modulus),
     .doc = "of grains and bodies; soft is fast"},
    {"wall_modulus", KEY_NUMBER, .unit = "Pa", .fallback = "=contact.youngs_modulus", RANGE(5e6, 1e16), AT(silt_contact_def, wall_modulus),
     .doc = "Young's modulus of the walls; a thousand times that of the grains is rigid"},
    {"poissons_ratio", KEY_NUMBER, .flags = KEY_OPEN_HIGH, RANGE(0, 0.5), AT(silt_contact_def, poissons_ratio),
     .doc = "of grains and bodies"},
    {"restitution", KEY_NUMBER, .flags = KEY_OPEN_LOW, RANGE(0.05, 1), AT(silt_contact_def, restitution), .doc = "coefficient of restitution"},
    {"friction", KEY_NUMBER, RANGE(0, 10), AT(silt_contact_def, friction), .doc = "coefficient of sliding friction"},
    {"rolling_friction", KEY_NUMBER, RANGE(0, 10), AT(silt_contact_def, rolling_friction),
     .doc = "coefficient of rolling friction"},
    {"body_friction", KEY_NUMBER, .fallback = "=contact.friction", RANGE(0, 10), AT(silt_contact_def, body_friction),
     .doc = "sliding friction of bodies against anything"},
    {"step", KEY_NUMBER, .fallback = "0.15", .flags = KEY_OPEN_LOW, RANGE(0, 0.5), AT(silt_contact_def, step),
     .doc = "time step of the contacts as a share of the Rayleigh time"},
    {"trace", KEY_SWITCH, .fallback = "false", AT(silt_contact_def, trace),
     .doc = "writes OUT/trace.csv: the contact force on every body that is not fixed and on the grain of every gauge grain_force at the end of "
            "every substep of the contacts"},
    {0}};
TABLE(contact, "the contact block", silt_contact_def, -1);

static const silt_key spring_rows[] = {
    {"at", KEY_POINT, .unit = "m", AT(silt_spring_def, at), .doc = "point of the body that it is tied to, where it is at the start"},
    {"to", KEY_POINT, .unit = "m", AT(silt_spring_def, to), .doc = "point in space that it leads to"},
    {"stiffness", KEY_NUMBER, .unit = "N/m", NOT_NEGATIVE, AT(silt_spring_def, stiffness),
     .doc = "force per change of its length (2-D: per metre of width)"},
    {"damping", KEY_NUMBER, .unit = "N s/m", .fallback = "0", NOT_NEGATIVE, AT(silt_spring_def, damping),
     .doc = "force per speed at which its length changes"},
    {"length", KEY_NUMBER, .unit = "m", .fallback = ".nan", NOT_NEGATIVE, AT(silt_spring_def, length),
     .doc = "without force; default: what it has at the start"},
    {"line", KEY_SWITCH, .fallback = "false", AT(silt_spring_def, line), .doc = "a mooring line: it pulls and does not push"},
    {0}};
TABLE(spring, "a spring", silt_spring_def, -1);

static const silt_key release_rows[] = {
    {"time", KEY_NUMBER, .unit = "s", .fallback = ".nan", NOT_NEGATIVE, AT(silt_body_def, release.time), .doc = "from which it is free"},
    {"force", KEY_NUMBER, .unit = "N", .fallback = ".nan", NOT_NEGATIVE, AT(silt_body_def, release.force),
     .doc = "that sets it free: of water, contacts, springs and weight together, in any direction (2-D: per metre of width)"},
    {0}};
TABLE(release, "until when the body is held", silt_body_def, -1);

static const silt_key body_rows[] = {
    {"name", KEY_NAME, AT(silt_body_def, name), .doc = "begins its columns in history.csv"},
    {"shape", KEY_WORD, .flags = KEY_SELECTOR, .words = shape_words, AT(silt_body_def, shape),
     .doc = "outline; disc in 2-D only, sphere, cylinder, tetrapod and surface in 3-D only"},
    {"at", KEY_POINT, .unit = "m", AT(silt_body_def, at), .doc = "centroid"},
    {"angle", KEY_NUMBER, .unit = "degrees", .fallback = "0", AT(silt_body_def, angle),
     .doc = "counter-clockwise, in 3-D seen from the tip of the axis"},
    {"axis", KEY_POINT, .flags = KEY_SPACE, .fallback = "[0, 0, 1]", AT(silt_body_def, axis), .doc = "what the angle turns about"},
    {"scale", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_body_def, scale),
     .doc = "width, diameter of a disc, sphere or cylinder, length of a capsule, height of a tetrapod; 0: a polygon or surface as it is, "
            "the others need it"},
    {"height", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE,
     .when = ONLY(SHAPE_BOX) | ONLY(SHAPE_CYLINDER) | ONLY(SHAPE_CAPSULE) | ONLY(SHAPE_WEDGE), AT(silt_body_def, height),
     .doc = "of a box or wedge, length of a cylinder, thickness of a capsule; 0: as the scale, of a capsule half of it"},
    {"depth", KEY_NUMBER, .unit = "m", .fallback = "0", .flags = KEY_SPACE, .low = 0, .high = HUGE_VAL,
     .when = ONLY(SHAPE_BOX) | ONLY(SHAPE_POLYGON) | ONLY(SHAPE_TEMPLE) | ONLY(SHAPE_WEDGE), AT(silt_body_def, depth),
     .doc = "along y; 0: as wide as deep"},
    {"density", KEY_NUMBER, .unit = "kg/m3", POSITIVE, AT(silt_body_def, density), .doc = "mean of the body"},
    {"velocity", KEY_POINT, .unit = "m/s", .fallback = "[0, 0]", AT(silt_body_def, velocity), .doc = "at the start"},
    {"spin", KEY_POINT, .unit = "rad/s", .flags = KEY_SPACE, .fallback = "[0, 0, 0]", AT(silt_body_def, spin),
     .doc = "angular velocity at the start"},
    {"condition", KEY_WORD, .fallback = "default", .words = wall_condition_words, AT(silt_body_def, condition),
     .doc = "of the water at its surface. slip and wall-law: it goes with the surface's normal only, but sticks to edges, at waterlines and in "
            "films of one cell. default: wall-law where fluid.flow is turbulent; where it is laminar no-slip if cells show the layer that sticks, "
            "h^3 g < 100 (viscosity/density)^2 with the least size h near bodies, else slip"},
    {"roughness", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_body_def, roughness),
     .doc = "equivalent sand roughness of the wall law; 0: smooth"},
    {"motion", KEY_WORD, .fallback = "free", .words = motion_words, AT(silt_body_def, motion),
     .doc = "free to move, held where it is, or moved by `path` whatever acts on it"},
    {"path", KEY_SERIES, .flags = KEY_OPTIONAL, AT(silt_body_def, path),
     .doc = "CSV file beside the scene: time in s, then any of x, y, z in m and angle in degrees from `at` and `angle`, or of their "
            "accelerations, as walls.motion says; only with motion: prescribed"},
    {"path_scale", KEY_NUMBER, .fallback = "1", AT(silt_body_def, path_scale), .doc = "factor on all columns of `path` but time"},
    {"baseline", KEY_WORD, .fallback = "none", .words = baseline_words, AT(silt_body_def, baseline), .doc = "of `path`, as walls.baseline says"},
    {"held", KEY_SET, .flags = KEY_OPTIONAL, .words = held_words, AT(silt_body_def, held),
     .doc = "components of a free body's motion that are none: [x, angle] leaves heave only, [x, y] roll; z in 3-D only"},
    {"springs", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &spring_table, MANY(silt_body_def, n_spring, spring),
     .doc = "springs and mooring lines of a free body"},
    {"release", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &release_table, .presence = PRESENT_FLAG, .present = offsetof(silt_body_def, release.on),
     .doc = "a free body that is held until a time or until a force acts on it"},
    {"clump_error", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, AT(silt_body_def, clump_error),
     .doc = "how far the spheres of its contacts may leave its surface; 0: as usual"},
    {"points", KEY_POLYGON, .unit = "m", .when = ONLY(SHAPE_POLYGON), MANY(silt_body_def, n_point, point),
     .doc = "corners of a polygon about any origin, in 3-D [x, z] of a prism along y"},
    {"file", KEY_SURFACE, .when = ONLY(SHAPE_SURFACE), AT(silt_body_def, file),
     .doc = "closed surface, STL or gmsh, triangles counter-clockwise from outside"},
    {0}};
TABLE(body, "a body", silt_body_def, offsetof(silt_body_def, shape));

static const silt_key gauge_rows[] = {
    {"name", KEY_NAME, AT(silt_gauge_def, name), .doc = "column of history.csv"},
    {"front", KEY_SIGN, .flags = KEY_CHOICE, .words = front_words, .select = GAUGE_FRONT, AT(silt_gauge_def, from),
     .doc = "foremost x of connected water to this side"},
    {"height_at", KEY_PLACE, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_HEIGHT, AT(silt_gauge_def, from),
     .doc = "top of connected water at this x (3-D: [x, y])"},
    {"depth_at", KEY_PLACE, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_DEPTH, AT(silt_gauge_def, from),
     .doc = "length of the vertical at this x (3-D: [x, y]) that is in water, as a wire gauge measures it: without the air under a jet"},
    {"wetted_at", KEY_POINT, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_WETTED, AT(silt_gauge_def, from),
     .doc = "1 when water is there, else 0"},
    {"pressure_at", KEY_POINT, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_PRESSURE, AT(silt_gauge_def, from),
     .doc = "pressure there, Pa"},
    {"velocity_at", KEY_POINT, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_VELOCITY, AT(silt_gauge_def, from),
     .doc = "velocity there, columns NAME_x, NAME_y, NAME_z"},
    {"discharge", KEY_SEGMENT, .unit = "m", .flags = KEY_CHOICE | KEY_PLANE, .select = GAUGE_DISCHARGE,
     AT(silt_gauge_def, from), .doc = "flow through the segment from its left to its right, with seepage also that through the bed, m2/s"},
    {"bed_level_at", KEY_PLACE, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_BED_LEVEL,
     AT(silt_gauge_def, from), .doc = "height of the bed at this x (3-D: [x, y])"},
    {"scour_at", KEY_PLACE, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_SCOUR,
     AT(silt_gauge_def, from), .doc = "how deep the bed lies under its level at the start, at this x (3-D: [x, y])"},
    {"bed_lowest", KEY_PAIR, .unit = "m", .flags = KEY_CHOICE | KEY_PLANE, .select = GAUGE_BED_LOWEST,
     AT(silt_gauge_def, from), .doc = "height of the lowest place of the bed's surface between these two x"},
    {"extent", KEY_SIGN, .flags = KEY_CHOICE, .words = extent_words, .select = GAUGE_EXTENT, AT(silt_gauge_def, from),
     .doc = "length of connected water along this axis, m"},
    {"grains_front", KEY_SIGN, .flags = KEY_CHOICE, .words = front_words, .select = GAUGE_GRAIN_FRONT, AT(silt_gauge_def, from),
     .doc = "foremost x to this side of the heap: the grains that hang together, the most mass of them"},
    {"grains_height_at", KEY_PLACE, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_GRAIN_HEIGHT, AT(silt_gauge_def, from),
     .doc = "top of the heap at this x (3-D: [x, y])"},
    {"grains_slope", KEY_PAIR, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_GRAIN_SLOPE, AT(silt_gauge_def, from),
     .doc = "angle in degrees by which the top of the heap falls to the right, by least squares between these two x"},
    {"grain_place", KEY_INTEGER, .flags = KEY_CHOICE, RANGE(1, INT32_MAX), .select = GAUGE_GRAIN_PLACE, AT(silt_gauge_def, index),
     .doc = "centre of this grain, those of the list from 1, then the regions'; columns NAME_x, NAME_y, NAME_z"},
    {"grain_velocity", KEY_INTEGER, .flags = KEY_CHOICE, RANGE(1, INT32_MAX), .select = GAUGE_GRAIN_VELOCITY,
     AT(silt_gauge_def, index), .doc = "of this grain, columns NAME_x, NAME_y, NAME_z"},
    {"grain_spin", KEY_INTEGER, .flags = KEY_CHOICE, RANGE(1, INT32_MAX), .select = GAUGE_GRAIN_SPIN, AT(silt_gauge_def, index),
     .doc = "angular velocity of this grain, rad/s, columns NAME_x, NAME_y, NAME_z"},
    {"grain_force", KEY_INTEGER, .flags = KEY_CHOICE, RANGE(1, INT32_MAX), .select = GAUGE_GRAIN_FORCE, AT(silt_gauge_def, index),
     .doc = "force of contacts on this grain, mean of the last step, N, columns NAME_x, NAME_y, NAME_z; per metre of width in 2-D"},
    {"force_on", KEY_INTEGER, .flags = KEY_CHOICE, RANGE(0, INT32_MAX), .select = GAUGE_FORCE,
     AT(silt_gauge_def, index),
     .doc = "force of the water on this wall of the list, from 0; columns NAME_x, NAME_y, NAME_z, N"},
    {"angular_momentum_about", KEY_POINT, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_ANGULAR,
     AT(silt_gauge_def, from),
     .doc = "of the water about this point, kg m2/s; in three dimensions columns NAME_x, NAME_y, NAME_z"},
    {"centroid_of", KEY_SIGN, .flags = KEY_CHOICE, .words = water_words, .select = GAUGE_CENTROID,
     AT(silt_gauge_def, from), .doc = "centre of mass of the water, columns NAME_x, NAME_y, NAME_z, m"},
    {"grains_in", KEY_BOX, .unit = "m", .flags = KEY_CHOICE, .select = GAUGE_GRAINS, AT(silt_gauge_def, from),
     .doc = "of the grains in this box: mean velocity by mass, columns NAME_x, NAME_y, NAME_z, m/s, and their mass, NAME_m, kg (2-D: per metre of width)"},
    {0}};
TABLE(gauge, "a gauge", silt_gauge_def, offsetof(silt_gauge_def, kind));

static const silt_key where_rows[] = {
    {"column", KEY_TEXT, AT(silt_check_def, where_column), .doc = "a column of the reference"},
    {"equals", KEY_NUMBER, AT(silt_check_def, where_value), .doc = "value of it in the rows that count"},
    {0}};
TABLE(where, "a row filter", silt_check_def, -1);

static const silt_key check_rows[] = {
    {"name", KEY_NAME, AT(silt_check_def, name), .doc = "for the report"},
    {"gauge", KEY_TEXT, .flags = KEY_CHOICE | KEY_SHORTHAND, .select = CHECK_COLUMN, AT(silt_check_def, column),
     .doc = "a gauge of the scene"},
    {"column", KEY_TEXT, .flags = KEY_CHOICE, .select = CHECK_COLUMN, AT(silt_check_def, column),
     .doc = "a column of history.csv"},
    {"profile", KEY_WORD, .flags = KEY_CHOICE, .select = CHECK_PROFILE, .words = check_profile_words,
     AT(silt_check_def, profile),
     .doc = "along a line at the time `at`, from the frames; the surface is the top of connected water; grains: volume of those "
            "with their centre in a layer across the line, over its thickness, m2 (2-D: m)"},
    {"reference", KEY_FILE, .flags = KEY_OPTIONAL, AT(silt_check_def, reference), .doc = "CSV file beside the scene"},
    {"x", KEY_TEXT, .flags = KEY_OPTIONAL, AT(silt_check_def, x),
     .doc = "abscissa in the reference; default its first column"},
    {"y", KEY_TEXT, .flags = KEY_OPTIONAL, AT(silt_check_def, y),
     .doc = "ordinate in the reference; default its second column"},
    {"where", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &where_table, .presence = PRESENT_TEXT,
     .present = offsetof(silt_check_def, where_column), .doc = "which rows of the reference count; default all"},
    {"time_scale", KEY_NUMBER, .fallback = "1", .when = ONLY(CHECK_COLUMN), AT(silt_check_def, time_scale),
     .doc = "the abscissa is time_scale (time + time_shift)"},
    {"time_shift", KEY_NUMBER, .unit = "s", .fallback = "0", .when = ONLY(CHECK_COLUMN), AT(silt_check_def, time_shift),
     .doc = "see time_scale"},
    {"place_scale", KEY_NUMBER, .fallback = "1", .when = ONLY(CHECK_PROFILE), AT(silt_check_def, place_scale),
     .doc = "the abscissa is place_scale (place + place_shift)"},
    {"place_shift", KEY_NUMBER, .unit = "m", .fallback = "0", .when = ONLY(CHECK_PROFILE),
     AT(silt_check_def, place_shift), .doc = "see place_scale"},
    {"line", KEY_SEGMENT, .unit = "m", .flags = KEY_OPTIONAL, .when = ONLY(CHECK_PROFILE), AT(silt_check_def, line),
     .doc = "the place is the distance from its start; a surface is taken above it; default the x axis"},
    {"scale", KEY_NUMBER, .fallback = "1", AT(silt_check_def, scale),
     .doc = "the ordinate is scale (column + shift), or scale (profile + shift)"},
    {"shift", KEY_NUMBER, .fallback = "0", AT(silt_check_def, shift), .doc = "see scale"},
    {"align", KEY_NUMBER, .fallback = ".nan", .when = ONLY(CHECK_COLUMN), AT(silt_check_def, align),
     .doc = "the curve is shifted in time so that both have this ordinate at the same abscissa"},
    {"window", KEY_PAIR, .fallback = "[-.inf, .inf]", .flags = KEY_INFINITE, AT(silt_check_def, window),
     .doc = "part of the abscissa that counts"},
    {"window_value", KEY_PAIR, .fallback = "[-.inf, .inf]", .flags = KEY_INFINITE, AT(silt_check_def, window_value),
     .doc = "part of the ordinate that counts"},
    {"norm", KEY_WORD, .fallback = "l2", .words = norm_words, AT(silt_check_def, norm),
     .doc = "of the difference: root of the mean square, largest, or the mean with its sign, as of a mean depth"},
    {"relative_to", KEY_NUMBER, .fallback = "0", NOT_NEGATIVE, AT(silt_check_def, relative_to),
     .doc = "what the difference is divided by; 0: the reference, point by point"},
    {"scalar", KEY_WORD, .fallback = "none", .words = scalar_words, .when = ONLY(CHECK_COLUMN),
     AT(silt_check_def, scalar), .doc = "a number made of the column instead of a reference"},
    {"at", KEY_NUMBER, .fallback = ".nan", AT(silt_check_def, at),
     .doc = "abscissa of the scalar `at`; time of a profile in s, between frames linear"},
    {"since", KEY_NUMBER, .unit = "s", .fallback = ".nan", .when = ONLY(CHECK_PROFILE), AT(silt_check_def, since),
     .doc = "the profile of grains is the mean of the frames from this time to `at`"},
    {"layer", KEY_NUMBER, .unit = "m", .fallback = "0", NOT_NEGATIVE, .when = ONLY(CHECK_PROFILE), AT(silt_check_def, layer),
     .doc = "thickness of the layer around every place of a profile of grains"},
    {"unit_at", KEY_NUMBER, .fallback = ".nan", .when = ONLY(CHECK_PROFILE), AT(silt_check_def, unit_at),
     .doc = "the profile of grains is divided by what it is at this abscissa"},
    {"level", KEY_NUMBER, .fallback = ".nan", .when = ONLY(CHECK_COLUMN), AT(silt_check_def, level),
     .doc = "ordinate that the scalar `reaches` waits for, or that `period` counts crossings of (default the mean)"},
    {"value", KEY_NUMBER, .fallback = ".nan", AT(silt_check_def, value), .doc = "expected scalar"},
    {"range", KEY_PAIR, .fallback = ".nan", .flags = KEY_INFINITE, AT(silt_check_def, low),
     .doc = "allowed scalar, instead of value and tolerance"},
    {"tolerance", KEY_NUMBER, .fallback = "0", NOT_NEGATIVE, AT(silt_check_def, tolerance),
     .doc = "of the norm, or of the scalar relative to its value (absolute when that is 0)"},
    {0}};
TABLE(check, "a check", silt_check_def, offsetof(silt_check_def, kind));

static const silt_key scene_rows[] = {
    {"silt", KEY_INTEGER, RANGE(1, 1), AT(silt_scene, version), .doc = "version of these keys"},
    {"title", KEY_TEXT, .fallback = "", AT(silt_scene, title), .doc = "one line about the scene"},
    {"dimension", KEY_INTEGER, .fallback = "2", RANGE(2, 3), AT(silt_scene, dimension),
     .doc = "2: x and y, y up; 3: x, y and z, z up"},
    {"periodic", KEY_PAIR, .unit = "m", .flags = KEY_OPTIONAL, AT(silt_scene, period),
     .doc = "the scene repeats in x: what leaves at one end enters at the other"},
    {"time", KEY_BLOCK, .sub = &time_table, .doc = "how long, how often, how fine"},
    {"bounds", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &bounds_table, .presence = PRESENT_FLAG, .present = offsetof(silt_scene, bounds.on),
     .doc = "how far the run's ledgers may be off before the run warns of it at its end and `silt verify` fails"},
    {"gravity", KEY_POINT, .unit = "m/s2", AT(silt_scene, gravity),
     .doc = "acceleration, for example [0, -9.81], in 3-D [0, 0, -9.81]"},
    {"fluid", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &fluid_table, .presence = PRESENT_FLAG,
     .present = offsetof(silt_scene, fluid.on), AT(silt_scene, fluid), .doc = "the water"},
    {"walls", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &wall_table, MANY(silt_scene, n_wall, wall),
     .doc = "what holds it"},
    {"bed", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &bed_table, .presence = PRESENT_FLAG,
     .present = offsetof(silt_scene, bed.on), AT(silt_scene, bed), .doc = "ground that the water can erode"},
    {"grains", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &grains_table, .presence = PRESENT_FLAG,
     .present = offsetof(silt_scene, grains.on), AT(silt_scene, grains), .doc = "loose grains; needed with a bed"},
    {"contact", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &contact_table, .presence = PRESENT_FLAG,
     .present = offsetof(silt_scene, contact.on), AT(silt_scene, contact),
     .doc = "how solids touch; needed with a bed, grains or bodies"},
    {"bodies", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &body_table, MANY(silt_scene, n_body, body),
     .doc = "rigid objects"},
    {"gauges", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &gauge_table, MANY(silt_scene, n_gauge, gauge),
     .doc = "what is measured at every step"},
    {"checks", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &check_table, MANY(silt_scene, n_check, check),
     .doc = "what the result is held against"},
    {0}};
const silt_key_table silt_scene_keys = {"the scene", sizeof(silt_scene), scene_rows, -1, false};

_Static_assert(offsetof(silt_region, hi) == offsetof(silt_region, lo) + 3 * sizeof(double), "box: lo, hi");
_Static_assert(offsetof(silt_wall, hi) == offsetof(silt_wall, lo) + 3 * sizeof(double), "box: lo, hi");
_Static_assert(offsetof(silt_gauge_def, to) == offsetof(silt_gauge_def, from) + 3 * sizeof(double),
               "segment: from, to");
_Static_assert(sizeof(silt_check_kind) == sizeof(int), "selectors are stored as int");
_Static_assert(offsetof(silt_check_def, high) == offsetof(silt_check_def, low) + sizeof(double), "pair: low, high");
_Static_assert(sizeof(silt_shape) == sizeof(int), "words are stored as int");
