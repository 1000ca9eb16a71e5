/** @file scene.h
 * What was asked: the scene as plain data, constant after reading. Every field below that a user can set is one row of the
 * table in scene_keys.c. SI units, angles in degrees as in the file. Lists are owned by the scene.
 * Geometry is stored with three components; in 2-D the third is 0.
 */
#ifndef SILT_SCENE_H
#define SILT_SCENE_H

#include "base.h"

/** a table over time (or over anything): a CSV beside the scene, or a constant */
typedef struct silt_series {
    int n_row, n_column;
    char **name;   // owned, n_column column names of the header
    double *value; // owned, n_row x n_column; column 0 is the abscissa; NaN: empty cells and columns of words
    int *line;     // owned, line of each row in the file
    char *path;    // owned, the file as it was opened
} silt_series;

/** what is taken off an acceleration so that a record does not drift away */
typedef enum { BASELINE_NONE = 0, BASELINE_VELOCITY, BASELINE_PLACE } silt_baseline;

typedef enum { REGION_BOX = 1, REGION_POLYGON, REGION_CIRCLE, REGION_SPHERE } silt_region_kind;
/** A closed part of the plane or of space. In 3-D a polygon stands upright: a prism over its corners (x, z), stored as the
 * first two of three numbers, from y = lo[1] to y = hi[1] (key `across`). A box with hi[2] > lo[2], a polygon with
 * hi[1] > lo[1] and a sphere are parts of space, all others of the plane. */
typedef struct silt_region {
    silt_region_kind kind;
    double lo[3], hi[3];      // box
    int n_point;              // polygon, counter-clockwise after reading
    double *point;            // owned, 3 per point: x, y (3-D: x, z), 0
    double centre[3], radius; // circle, sphere
    char *outline;            // owned, CSV file with the polygon's corners; NULL: given in the scene
} silt_region;

typedef enum {
    WALL_NO_SLIP = 0,
    WALL_SLIP,
    WALL_LAW, // slip with the traction of the logarithmic law of the wall
    WALL_DEFAULT, // wall law where the flow is turbulent, no-slip where it is laminar, on bodies slip where cells are too coarse for it; replaced while reading
} silt_condition;
/** how a wall is given; a 2-D box becomes a closed polyline while reading */
typedef enum { WALL_POLYLINE = 1, WALL_BOX, WALL_SURFACE } silt_wall_form;
/** 2-D: a chain of straight wall segments with the water on its left; 3-D: a box around the water or a triangulated surface */
typedef struct silt_wall {
    silt_wall_form form; // 0 counts as a polyline
    int n_point;    // at least 2; in 2-D `box` is read as its closed counter-clockwise outline
    double *point;  // owned, 3 per point
    bool closed;
    silt_condition condition;
    double roughness; // m, equivalent sand roughness k_s of the wall law; 0: smooth
    double lo[3], hi[3]; // 3-D, WALL_BOX: a closed box around the water; hi < lo after reading: none
    char *surface;       // owned, 3-D: STL or .msh file of a triangulated surface, NULL: none
    double scale;        // 3-D: what the surface's coordinates are multiplied by
    bool inside_out;     // 3-D: the surface's normals point out of the water
    double velocity[3];  // m/s, of the wall's surface along itself (a lid, a belt); no part of `motion`
    silt_series motion;  // a path (silt_path_at); in 3-D the angle turns about the y axis, from x to z; n_row 0: stands still
    double motion_scale; // 1, factor on the numbers of its file
    silt_baseline baseline; // of accelerations
    double pivot[3];     // m, what `angle` turns about
} silt_wall;

/** eddies that are there at the start, or come in with water, of spalart-allmaras; both 0: three times the water's own viscosity */
typedef struct silt_eddy_def {
    double viscosity; // m2/s, the same everywhere
    double shear;     // m/s, shear velocity u*: 0.41 u* d (1 - d/D), d the distance to the wall, D the depth
} silt_eddy_def;

/** what drives the water in: exactly one is given in a scene */
typedef enum { INLET_VELOCITY = 1, INLET_HEAD } silt_inlet_drive;
/** water fed in through the segment from-to (water on its left), in 3-D through a flat, convex polygon (counter-clockwise as the
 * water sees it) */
typedef struct silt_inlet {
    char *name;
    silt_inlet_drive drive; // 0 counts as INLET_VELOCITY
    double from[3], to[3];
    int n_corner;
    double *corner;      // owned, 3 per point
    double velocity[3];  // m/s; multiplied by column 1 of the series when there is one
    silt_series series;  // n_row 0: constant; in the scene the name of a CSV file
    silt_eddy_def eddy;  // of the water that comes in
    double grains;       // kg/s, 2-D per metre of width: sediment that comes in with the water; multiplied by the series too
    silt_series head;    // level over time (time, level), m, of still water behind it; n_row 0: velocity-driven
} silt_inlet;

/** nodes and grains that cross the segment from-to from left to right leave and are counted; in 3-D the polygon from the side that
 * sees it counter-clockwise */
typedef struct silt_outlet {
    char *name;
    double from[3], to[3];
    int n_corner;
    double *corner;    // owned, 3 per point
    silt_series level; // level over time (time, level), m, of the water behind it; n_row 0: free outfall
} silt_outlet;

typedef enum {
    FORMULA_NONE = 0,
    FORMULA_UNIFORM,        // vector
    FORMULA_SOLID_ROTATION, // rate, centre
    FORMULA_SHEAR,          // rate: v = (rate (y - centre_y), 0)
    FORMULA_STRAIN,         // rate: v = (-rate x, rate y) about centre
    FORMULA_TAYLOR_GREEN,   // amplitude, length, centre (the box's corner)
    FORMULA_STANDING_WAVE,  // amplitude (m, of the surface), wavelength (length), depth, centre: bed at the left antinode
    FORMULA_SOLITARY_WAVE,  // amplitude (height H), depth, profile, centre: bed below the crest; sign of rate: direction (0: +x)
    FORMULA_FIELD,          // CSV of points x,y[,z],vx,vy[,vz]: linear on the Delaunay cell of points around, exact at a point
    FORMULA_CENTRAL,        // acceleration -rate |rate| (x - centre): to the centre, with a negative rate away from it
    FORMULA_SERIES,         // CSV over time, the same everywhere; after reading the columns are time, x, y, z
} silt_formula_kind;
typedef enum { WAVE_BOUSSINESQ = 0, WAVE_GRIMSHAW } silt_wave_profile; // eta = H sech^2(k x), or to third order in H/d
typedef struct silt_field silt_field; // the points of FORMULA_FIELD by place (formula.c)
/** A velocity at the start, or an acceleration (body force). In 3-D the plane of the 2-D formulas is x-z; a solid rotation
 * is right-handed about `axis`. */
typedef struct silt_formula {
    silt_formula_kind kind;
    int dimension;               // 2 or 3; 0 counts as 2
    int axis;                    // 3-D: 1 to 3: x, y, z; 0: z for a rotation, for CENTRAL the distance from the point
    double vector[3], centre[3]; // vector: added to what the formula gives, to every kind but FORMULA_NONE
    double rate, amplitude, length, depth;
    silt_wave_profile profile;
    double wave[6];     // of the solitary wave's velocity, see formula.c; wave[0] = 0: not found yet
    silt_series series; // FIELD: columns x, y[, z], vx, vy[, vz] in this order after reading; SERIES
    silt_field *field;  // owned, FIELD: made while reading; NULL: the series is searched from end to end
} silt_formula;

/** how water flows in the small */
typedef enum { FLOW_TURBULENT = 0, FLOW_LAMINAR } silt_flow;
typedef enum {
    TURBULENCE_AUTO = 0,
    TURBULENCE_NONE,
    TURBULENCE_MIXING_LENGTH,
    TURBULENCE_SMAGORINSKY,
    TURBULENCE_WALE,
    TURBULENCE_SPALART_ALLMARAS,
} silt_turbulence;
typedef enum { RHEOLOGY_NEWTONIAN = 0, RHEOLOGY_BINGHAM, RHEOLOGY_HERSCHEL_BULKLEY } silt_rheology;

/** where nodes stand closer or farther than fluid.size */
typedef enum { NEAR_REGION = 1, NEAR_WALLS, NEAR_BED, NEAR_BODIES, NEAR_SURFACE } silt_near;
typedef struct silt_size_def {
    silt_near near;     // what the size belongs to
    silt_region region; // NEAR_REGION
    double size;        // m
    double distance;    // 0, m, how far around it the size holds
} silt_size_def;

typedef enum { SCHEME_IMPLICIT = 0, SCHEME_FRACTIONAL } silt_scheme;
typedef enum { PRESSURE_CONSISTENT = 0, PRESSURE_LAPLACIAN } silt_pressure_operator;

typedef struct silt_fluid_def {
    bool on;
    double density;   // kg/m3, required
    double viscosity; // Pa s, required
    double size;      // m, node spacing h, required
    silt_scheme scheme;             // scheme: implicit | fractional
    silt_pressure_operator pressure; // pressure: consistent | laplacian
    silt_flow flow;             // flow: turbulent | laminar
    silt_turbulence turbulence; // auto: mixing-length in 2-D, wale in 3-D when the flow is turbulent, else none; replaced while reading
    silt_eddy_def eddy;         // at the start
    double wall_height;  // 2, times h, where the wall law samples the velocity
    silt_rheology rheology;
    double yield_stress; // Pa, 0
    double flow_index;   // 1, n of Herschel-Bulkley: stress = yield_stress + viscosity rate^n
    double plastic_rate; // 1e-3 1/s, shear rate below which the yield stress is smoothed (regularised)
    int order;           // 2: trapezoidal in time, 1: backward Euler
    double theta;        // 0.5 to 1, implicitness of the step; key 0: what `order` says, replaced while reading
    double alpha;        // 1.3, alpha shape of what was water a step ago, times h
    double merge;        // width of a gap between two surfaces that closes and becomes water, times h
    double tolerance;    // relative residual of the continuity equation
    int iterations;      // largest number of iterations per step
    bool volume_control; // give back what remeshing created or lost, over volume_steps steps
    double volume_steps;
    double volume_time;  // s, and at least this long; 0: 2 sqrt(size/g)
    double jitter;       // times h, random shift of the initial nodes inside the water
    int seed;
    int n_region;
    silt_region *region; // owned
    char *cloud;         // owned, CSV file of nodes x,y[,z][,vx,vy[,vz]] by name in place of the regular cloud; NULL: none
    double shuffle;      // times h: inner nodes are shifted at random in every step (a test of remeshing)
    double size_growth;  // 0.3, largest change of size per distance
    int n_size;
    silt_size_def *size_at; // owned; key `sizes`
    double air_pressure; // 0, Pa, absolute, of closed air pockets at their making; 0: pockets have no pressure
    double air_exponent; // 1.4, of their adiabatic compression
    double surface_tension; // 0, N/m
    silt_formula force;  // acceleration besides gravity; key body_force
    int n_inlet;
    silt_inlet *inlet; // owned
    int n_outlet;
    silt_outlet *outlet; // owned
    silt_formula velocity; // initial
} silt_fluid_def;

typedef enum { BED_FRICTIONAL_WORK = 1, BED_DISSIPATION, BED_POWER, BED_EXCESS_SHEAR, BED_SHIELDS } silt_bed_law;
typedef enum { SHEAR_DEFAULT = 0, SHEAR_PAPER, SHEAR_GRADIENT, SHEAR_LOG_LAW } silt_bed_shear;
typedef enum { SEEPAGE_NONE = 0, SEEPAGE_DARCY, SEEPAGE_KOZENY_CARMAN } silt_seepage;
typedef struct silt_bed_def {
    bool on;
    double density;   // kg/m3 of the grains' solid, required
    double porosity;  // required
    silt_bed_law law; // law: frictional-work | dissipation | power | excess-shear | shields
    double work;      // J/m3, W_c of the first three laws, required; .inf: never erodes
    double erodibility; // m3/(N s), k_d of excess-shear, required
    double critical;  // critical Shields number of the law shields; 0: Soulsby and Whitehouse
    silt_bed_shear shear; // how the stress on the bed is found; after reading never default
    double distance;  // m, h_k, where shear: paper samples the velocity; default fluid.size
    double roughness; // m, k_s of shear: log-law and of the wall law on the bed; 0: 2.5 grains.diameter
    double size;      // m, spacing of the bed's nodes; default fluid.size
    double layer;     // m, layer thickness h_0 that one W_c removes; 0: the patch height
    double threshold; // Pa, tau_c, shear stress below which nothing wears; default 0; of shields: from critical
    double repose;    // degrees, angle of repose; 0: a bed that stands at any slope
    bool slope;       // default true: with repose, the threshold hangs on the slope
    bool cover;       // default true: what resting parcels cover does not wear
    int densify;       // key deposit: densify: resting grains first fill what is looser than the bed; default grow
    double deposit_work; // J/m3, W_c of what was deposited; 0: work
    double saturation; // share of the pores that holds water, default 1
    silt_seepage seepage; // seepage: none | darcy | kozeny-carman
    double permeability;  // m2, with seepage: darcy
    bool fluidise;     // seepage that outweighs the grains lifts them off the surface, default true
    bool deposition;   // default true
    silt_condition condition; // of water on the bed, default no-slip
    int n_region;
    silt_region *region; // owned
} silt_bed_def;

/** true where water can wear the bed */
static inline bool silt_bed_erodes(const silt_bed_def *bed) {
    return bed->on && (bed->law > BED_POWER || isfinite(bed->work));
}

typedef enum {
    DRAG_NONE = 0,
    DRAG_SCHILLER_NAUMANN,
    DRAG_DI_FELICE,
    DRAG_STOKES,
    DRAG_ABRAHAM,
    DRAG_ERGUN,
    DRAG_WEN_YU,
    DRAG_GIDASPOW,
    DRAG_KOCH_HILL,
    DRAG_BEETSTRA,
} silt_drag_law;
typedef enum { LIFT_NONE = 0, LIFT_SAFFMAN } silt_lift_law;
/** a grain that is there from the start */
typedef struct silt_grain_def {
    double at[3], velocity[3];
    double diameter; // m
    double density;  // kg/m3
    bool fixed;      // held where it is, default false
} silt_grain_def;
typedef enum { ARRANGE_RANDOM = 0, ARRANGE_LATTICE } silt_arrangement;
/** a region full of grains at the start (fill.c) */
typedef struct silt_fill_def {
    silt_region region;
    double diameter;    // m; 0: what the sieve says
    silt_series sieve;  // diameter in m, share of the mass that passes; n_row 0: none
    double density;     // kg/m3
    double velocity[3];
    double porosity;    // share of the region's area (3-D: volume) between the grains; 0: not given
    int count;          // grains; 0: not given
    silt_arrangement arrangement;
    int seed;
    bool fixed; // its grains are held where they are, default false
} silt_fill_def;
typedef struct silt_grains_def {
    bool on;              // true when the block is there; bodies alone need contact properties too: see contact
    silt_drag_law drag;   // drag: none | stokes | schiller-naumann | ..., docs/grains.md
    double diameter;      // m, d50 of the bed's grains: default parcel
    double parcel;        // m, diameter of the discrete elements that released bed becomes; required with a bed
    int per_patch;        // parcels that a patch of the bed becomes; 0: as many of the size `parcel` as make its mass
    silt_series sieve;    // diameter in m, share of the mass that passes, of the parcels; n_row 0: all alike
    double width;         // m, accounting width in 2-D; 0: (2/3)(0.82) d/(1 - n) of the parcel, or 5 d without bed
    double kernel;        // m, width of the porosity kernel; 0: max(3 d, 2 h)
    bool across;          // 3-D, with kernel_layers: what goes through a side of the walls in y comes in at the other, default false
    double gusts;         // s, 0: none; how long each lasts
    bool kernel_layers;   // the kernel takes means along x (3-D: and y) in layers, default false
    double added_mass;    // 0, coefficient, of the displaced water's mass; spheres: 0.5
    silt_lift_law lift;   // lift: none | saffman
    bool viscous_force;   // V div tau, default false
    bool rotational_drag; // torque on the spin, default false
    double eddy_limit;    // 0, share of grains at which eddies have no room; 0: grains do not hinder them
    bool random_walk;     // of suspended grains in the eddies, default false
    bool pick_up;         // of grains at rest too, default false
    double schmidt;       // 1, eddy viscosity over the grains' diffusivity
    int n_grain;
    silt_grain_def *grain; // owned; key `list`
    int n_fill;
    silt_fill_def *fill;   // owned; key `regions`
    int n_filled, filled_capacity;
    silt_grain_def *filled; // owned, made while reading: the regions' grains, region by region
} silt_grains_def;

/** contact properties of grains, bodies and walls; block `contact`, required with grains, bed or bodies */
typedef struct silt_contact_def {
    bool on;
    double youngs_modulus;   // Pa, 5e6 to 1e12
    double wall_modulus;     // Pa, Young's modulus of the walls; default youngs_modulus
    double poissons_ratio;
    double restitution;      // 0.05 to 1
    double friction;
    double rolling_friction;
    double body_friction;    // bodies against anything; default friction
    double step;             // share of the Rayleigh time, default 0.15
    bool trace;              // contact forces of every substep into a file, default false
} silt_contact_def;

typedef enum {
    SHAPE_BOX = 1,  // scale wide, height high, in 3-D depth deep
    SHAPE_DISC,     // 2-D, scale is the diameter
    SHAPE_POLYGON,  // points relative to any origin, simple polygon; scaled so that its width is `scale` if scale > 0; 3-D: a prism
                    // over points [x, z], depth deep
    SHAPE_TEMPLE,   // columns under a roof, width `scale`; made in dem-coupling/shape.c and form.c
    SHAPE_SPHERE,   // 3-D, scale is the diameter
    SHAPE_CYLINDER, // 3-D, upright, scale is the diameter, height the length
    SHAPE_CAPSULE,  // lies along x, scale long, height thick
    SHAPE_WEDGE,    // isosceles, its edge down, scale wide, height high
    SHAPE_TETRAPOD, // 3-D, scale high, one leg up
    SHAPE_SURFACE,  // 3-D, a closed surface from `file`; its width made `scale` if scale > 0
} silt_shape;
typedef enum { MOTION_FREE = 0, MOTION_FIXED, MOTION_PRESCRIBED } silt_motion;
/** components of a body's motion, bits of silt_body_def.held */
enum { HELD_X = 1, HELD_Y = 2, HELD_Z = 4, HELD_ANGLE = 8, HELD_ALL = 15 };
/** a spring or line between a point of the body and a point in space */
typedef struct silt_spring_def {
    double at[3];     // m, the point of the body where it is at the start
    double to[3];     // m
    double stiffness; // N/m; 2-D: per metre of width, as all forces
    double damping;   // N s/m, of the speed at which its length changes
    double length;    // m, at rest; after reading never NaN
    bool line;        // pulls, does not push
} silt_spring_def;
/** until when a body is held */
typedef struct silt_release_def {
    bool on;
    double time;  // s; NaN: not by time
    double force; // N, of all that acts on it; NaN: not by force
} silt_release_def;
typedef struct silt_body_def {
    char *name; // [a-z][a-z0-9_]*, unique
    silt_shape shape;
    double at[3];   // of the centroid, m
    double angle;   // degrees
    double axis[3]; // 3-D: what the angle turns about
    double scale;   // m, width
    double height;  // m; 0: as the shape says
    double depth;   // m, 3-D, along y; 0: scale
    double density; // kg/m3
    double velocity[3];
    double spin[3]; // rad/s, 3-D, at the start
    silt_condition condition; // of water on it
    double roughness; // m, equivalent sand roughness of the wall law
    silt_motion motion;
    silt_series path;  // MOTION_PRESCRIBED: a path (silt_path_at)
    double path_scale; // 1, factor on the numbers of its file
    silt_baseline baseline; // of accelerations
    int held;          // HELD_ bits: components of the motion that are none
    int n_spring;
    silt_spring_def *spring; // owned
    silt_release_def release;
    double clump_error; // m, how far the spheres of its contacts may leave its surface; 0: as many as are usual
    int n_point;
    double *point; // owned, polygon only, 3 per point, counter-clockwise after reading
    char *file;    // owned, surface only
} silt_body_def;

typedef enum {
    GAUGE_FRONT = 1,  // front: x | -x: the foremost x of connected water
    GAUGE_HEIGHT,     // height_at: X (3-D: [x, y], in from[0] and from[1]): top of connected water above that place
    GAUGE_WETTED,     // wetted_at: [x, y] (3-D: [x, y, z]): 1 when water is there
    GAUGE_PRESSURE,   // pressure_at: [x, y] (3-D: [x, y, z])
    GAUGE_VELOCITY,   // velocity_at: [x, y] (3-D: [x, y, z]): columns NAME_x, NAME_y, NAME_z
    GAUGE_DISCHARGE,  // discharge: [[x, y], [x, y]]: m2/s through the segment, left to right
    GAUGE_BED_LEVEL,  // bed_level_at: X
    GAUGE_SCOUR,      // scour_at: X: how deep the bed lies under its level at the start
    GAUGE_EXTENT,     // extent: x | y | z: length of connected water along that axis
    GAUGE_FORCE,      // force_on: I: force of the water on wall I of the scene: columns NAME_x, NAME_y, NAME_z
    GAUGE_ANGULAR,    // angular_momentum_about: [x, y]; in 3-D columns NAME_x, NAME_y, NAME_z
    GAUGE_CENTROID,   // centroid_of: water: columns NAME_x, NAME_y, NAME_z
    GAUGE_GRAIN_FRONT,  // grains_front: x | -x: the foremost x of the grains that hang together
    GAUGE_GRAIN_HEIGHT, // grains_height_at: X (3-D: [x, y]): their top above that place
    GAUGE_GRAIN_SLOPE,  // grains_slope: [x0, x1]: degrees by which it falls to the right, from x0 = from[0] to x1 = from[1]
    GAUGE_GRAIN_PLACE,    // grain_place: K: of grain K (silt_gauge_def.index): columns NAME_x, NAME_y, NAME_z
    GAUGE_GRAIN_VELOCITY, // grain_velocity: K
    GAUGE_GRAIN_SPIN,     // grain_spin: K
    GAUGE_GRAIN_FORCE,    // grain_force: K: of its contacts
    GAUGE_GRAINS,     // grains_in: [[x, y], [x, y]] (3-D: three each): of the grains there NAME_x, NAME_y, NAME_z, NAME_m (mass)
    GAUGE_DEPTH,      // depth_at: X (3-D: [x, y]): how much of the vertical there is in water
    GAUGE_BED_LOWEST, // bed_lowest: [x0, x1]: the lowest place of the bed's surface from x0 = from[0] to x1 = from[1]
} silt_gauge_kind;
typedef struct silt_gauge_def {
    char *name; // column name(s) in history.csv
    silt_gauge_kind kind;
    double from[3], to[3]; // place; FRONT: from[0] is +1 or -1; EXTENT: from[0] is the axis, 0 to 2
    int index;             // FORCE: of the wall
} silt_gauge_def;
/** how many history columns gauge i has, and the name of its k-th one (gauge.c) */
int silt_gauge_columns(const silt_scene *scene, int i);
void silt_gauge_column(const silt_scene *scene, int i, int k, char name[64]);

typedef enum { NORM_L2 = 1, NORM_MAX, NORM_MEAN } silt_norm;
typedef enum {
    SCALAR_NONE = 0,
    SCALAR_MAX,
    SCALAR_MIN,
    SCALAR_LAST,
    SCALAR_MEAN,
    SCALAR_PERIOD,    // mean distance of upward crossings of `level`, or of the mean
    SCALAR_SLOPE,     // least squares
    SCALAR_AT,        // the ordinate at abscissa `at`
    SCALAR_REACHES,   // the first abscissa where the ordinate passes `level`
    SCALAR_AMPLITUDE, // half of the largest less the smallest
    SCALAR_DECAY,     // rate at which the heights of successive half waves fall
} silt_scalar;
/** what a check looks at */
typedef enum { CHECK_COLUMN = 1, CHECK_PROFILE } silt_check_kind;
/** what a profile shows along a line */
typedef enum { PROFILE_SURFACE = 1, PROFILE_VELOCITY_X, PROFILE_VELOCITY_Y, PROFILE_VELOCITY_Z, PROFILE_SPEED, PROFILE_PRESSURE, PROFILE_GRAINS } silt_profile;
/** what to hold the result against: a history column or a profile against a CSV column, or a scalar of the column against a value.
 * The history's abscissa is time_scale * (time + time_shift), its ordinate scale * (column + shift). */
typedef struct silt_check_def {
    char *name;
    char *column;      // key `gauge` or `column`: a column of history.csv
    char *reference;   // file beside the scene, NULL for a scalar
    char *x, *y;       // column names in the reference
    char *where_column; // only reference rows with this column ...
    double where_value; // ... equal to this; keys where: {column: , equals: }
    double time_scale, time_shift, scale, shift; // defaults 1, 0, 1, 0
    double align;       // NaN: none; else the curve is shifted in time so that both have this ordinate at the same abscissa
    double window[2];   // of the abscissa after scaling; default all
    double window_value[2]; // only where the ordinate (reference's, or the column's for a scalar) lies in here; default all
    silt_norm norm;     // norm: l2 | max | mean, of the difference divided by `relative_to`, or pointwise by the reference when 0
    double relative_to; // default 0
    silt_scalar scalar; // scalar: max | min | last | mean | period | slope
    double value;       // expected scalar
    double low, high;   // or the allowed range instead of value and tolerance; NaN when not given
    silt_check_kind kind;
    // a profile: along the line at a time of the frames; abscissa place_scale * (distance from the line's start + place_shift)
    silt_profile profile;
    double line[6];     // m, two points; equal: the x axis
    double place_scale, place_shift;
    double at;          // s, time of the profile; abscissa of SCALAR_AT
    double since;       // s, PROFILE_GRAINS: mean from here to `at`; NaN: of `at` alone
    double layer;       // m, PROFILE_GRAINS: thickness around the place
    double unit_at;     // PROFILE_GRAINS: abscissa where the profile is 1; NaN: as it is
    double level;       // ordinate of SCALAR_REACHES and SCALAR_PERIOD; NaN: the mean
    double tolerance;   // relative to |value|, absolute when value is 0
} silt_check_def;

struct silt_scene {
    char *path;     // owned, as given
    char *folder;   // owned, where CSV files are looked for
    char *resolved; // owned, the resolved scene as YAML text (with -D and defaults), reads back to the same scene
    uint64_t hash;  // of resolved
    int version;    // silt: 1
    char *title;
    int dimension;  // 2 or 3
    double period[2]; // m, x from period[0] to period[1] is periodic; equal: not
    struct {
        double end, output;    // s, required
        double step;           // s, largest dt; 0: none
        double cfl;            // share of a cell that a node may cross in a step
        double checkpoint;     // s of model time between checkpoints, 0: 10 outputs
        double wall;           // s on the clock of the wall that a process may take, then it stops with a checkpoint; 0: no limit
        int64_t steps;         // most steps, 0: no limit
        int retries;           // how often a failed step is halved
    } time;
    struct {
        bool on;                     // the block was there; the numbers always are
        double volume, mass, energy; // shares that a run may be off by before it says so (silt_bounds)
    } bounds;
    double gravity[3];
    silt_fluid_def fluid;
    int n_wall;
    silt_wall *wall; // owned
    silt_bed_def bed;
    silt_grains_def grains;
    silt_contact_def contact;
    int n_body;
    silt_body_def *body; // owned
    int n_gauge;
    silt_gauge_def *gauge; // owned
    int n_check;
    silt_check_def *check; // owned
};

/** column of the series at abscissa x: linear between rows, constant outside */
double silt_series_at(const silt_series *series, int column, double x);
/** Reads a CSV: '#' comments, a header with names, numbers. A column whose first cell is no number holds words: all NaN.
 * Says nothing about the order of the rows (reference tables hold several curves): see silt_series_rising.
 * @param base folder that a relative path starts from */
silt_status silt_series_read(const char *base, const char *path, silt_series *series, silt_error *err);
void silt_series_clear(silt_series *series);
void silt_series_constant(silt_series *series, double value); /**< a table of one row: time 0, the value in column 1 */
int silt_series_column(const silt_series *series, const char *name); /**< column of that name, -1: none */
/** What silt_series_at needs: two columns or more, finite numbers, column 0 strictly rising. The error names file and line. */
silt_status silt_series_rising(const silt_series *series, silt_error *err);

enum { PATH_COLUMNS = 8 };
/** A path: time in s first, then by name any of x, y, z in m and angle in degrees from the place in the scene, linear between rows,
 * constant outside; or their accelerations ax, ay, az, aangle, linear between rows, from rest at the first row, none after the last.
 * @return how many columns it may have besides time, *name: which */
int silt_path_columns(int dimension, const char *const **name);
bool silt_path_accelerates(const silt_series *path);
int silt_path_doubled(const silt_series *path); /**< column of an acceleration whose place is given too, -1: none */
/** Multiplies by scale and integrates the accelerations once: columns of places and velocities are added. */
void silt_path_settle(silt_series *path, double scale, silt_baseline baseline);
/** x, y, z in m and the angle in radians at a time, exact */
void silt_path_at(const silt_series *path, double time, double place[4]);

/** m, k_s of the bed */
static inline double silt_bed_roughness(const silt_scene *s) {
    return s->bed.roughness > 0 ? s->bed.roughness : 2.5 * s->grains.diameter;
}

/** diameter that the share q of all grains of a sieve curve, by number, is smaller than, m (fill.c) */
double silt_sieve_quantile(const silt_series *sieve, double q);
/** Grains drawn from a sieve curve whose mass is that of one of diameter `whole`, when mass goes with diameter^power: the same for the
 * same seed. All are scaled alike so that their shares of the mass add up to 1 but for rounding. @return how many */
int silt_sieve_draw(const silt_series *sieve, uint64_t seed, double whole, double power, int capacity, double *share);
/** all grains that are there at the start: the list's, then the regions' */
static inline int silt_scene_grains(const silt_scene *s) { return s->grains.n_grain + s->grains.n_filled; }
static inline const silt_grain_def *silt_scene_grain(const silt_scene *s, int i) {
    return i < s->grains.n_grain ? &s->grains.grain[i] : &s->grains.filled[i - s->grains.n_grain];
}

/** whether water goes with the body's normal only */
static inline bool silt_body_slips(const silt_body_def *body) { return body->condition != WALL_NO_SLIP; }
/** whether something in the scene has the law of the wall (scene_settle.c) */
bool silt_scene_law(const silt_scene *s);
/** how many of its bodies move */
static inline int silt_scene_moves(const silt_scene *s) {
    int n = 0;
    for (int i = 0; i < s->n_body; i++)
        n += s->body[i].motion != MOTION_FIXED;
    return n;
}

/** what a scene needs */
static inline bool silt_scene_has_dem(const silt_scene *s) { return s->grains.on || s->n_body > 0; }

/** s, step in which the shortest ripples that cells of size h carry move by about their length (Brackbill et al. 1992) */
static inline double silt_tension_time(double tension, double density, double h) {
    return tension > 0 ? sqrt(density * h * h * h / (2 * M_PI * tension)) : HUGE_VAL;
}

/** which coordinate points up: y in 2-D, z in 3-D */
static inline int silt_scene_up(const silt_scene *s) { return s->dimension == 3 ? 2 : 1; }

/** a part of space (points of three numbers), not of the plane (two) */
bool silt_region_space(const silt_region *region);
/** @param x  2 numbers, 3 for a part of space */
bool silt_region_contains(const silt_region *region, const double *x);
/** how deep x lies in it: the distance to its rim; outside negative, the rim as far at least */
double silt_region_depth(const silt_region *region, const double *x);
double silt_region_area(const silt_region *region); /**< m2; m3 of a part of space */
/** the box around it: 2 numbers each, 3 for a part of space */
void silt_region_bounds(const silt_region *region, double *lo, double *hi);

// polygons and chains, 3 numbers per point, the third unused
double silt_polygon_area(int n, const double *point); /**< positive when counter-clockwise */
void silt_polygon_centroid(int n, const double *point, double centre[3]);
bool silt_polygon_contains(int n, const double *point, const double *x);
bool silt_segments_meet(const double *a, const double *b, const double *c, const double *d); /**< touching counts */
double silt_segment_distance(const double *a, const double *b, const double *x); /**< of x to the segment a b */
bool silt_chain_straight(int n, const double *point); /**< all points on one line */
/** true when two edges meet elsewhere than at a shared corner; crossing: their indices, the smaller first */
bool silt_chain_crosses(int n, const double *point, bool closed, int crossing[2]);

/** Velocity of the formula at x, m/s.
 * @param g  m/s2, magnitude of gravity (waves)
 * @param x  m, formula->dimension numbers
 * @param v  out, 3 numbers, the third 0 in 2-D */
void silt_formula_velocity(const silt_formula *formula, double g, const double *x, double *v);
/** Acceleration of a body force at time and x, m/s2; x and a as above. */
void silt_formula_acceleration(const silt_formula *formula, double time, const double *x, double *a);
/** m2/s2, potential of a central acceleration at x, without `vector` */
double silt_formula_potential(const silt_formula *formula, const double *x);
/** height of the solitary wave's surface over still water at x[0], m */
double silt_formula_surface(const silt_formula *formula, const double *x);
/** Does once what every look-up would do anew: sorts the points of FORMULA_FIELD by place, so that a look-up takes
 * O(log n), finds the coefficients of FORMULA_SOLITARY_WAVE. Called while reading; without it both are only slower.
 * @return -1, or the row of a point of the field that stands there twice (it is not sorted then) */
int silt_formula_prepare(silt_formula *formula);
void silt_formula_clear(silt_formula *formula); /**< frees series and field */

/** true for the name of a shape that gmsh has to triangulate: .geo, .step, .brep, .iges */
bool silt_surface_is_shape(const char *path);

/** An inlet or outlet as a place: the outlets count on after the inlets. All borrowed from the scene. */
typedef struct silt_opening {
    int dim, n_corner;
    const double *corner; // 3-D, 3 per point
    const double *from, *to; // 2-D
    double normal[3];     // unit, into the water in front of it
    double size;          // m, its longest extent
    const silt_series *level; // of still water behind it, NULL: prescribed velocity, or free outfall
    bool inlet;
} silt_opening;
static inline int silt_opening_count(const silt_scene *scene) { return scene->fluid.n_inlet + scene->fluid.n_outlet; }
silt_opening silt_opening_of(const silt_scene *scene, int k);
/** signed distance of x (dim numbers) from its plane, positive in front, m */
double silt_opening_height(const silt_opening *opening, const double *x);
/** how deep the foot of x in its plane lies within its rim, negative outside, m */
double silt_opening_depth(const silt_opening *opening, const double *x);
/** the opening (with a level; velocity too: or a prescribed velocity) whose piece of plane x lies on within `gap`, or -1 */
int silt_opening_on(const silt_scene *scene, const double *x, double gap, bool velocity);

/** The files that the scene reads, with their folders, in the order of the resolved text; the same file may come twice.
 * @return how many; *file is owned by the caller, the names are the scene's */
int silt_scene_files(const silt_scene *scene, const char ***file);
/** the resolved text with file k called name[k]; owned by the caller */
char *silt_scene_text_named(const silt_scene *scene, const char *const *name);

/** Prints what the table of keys says: one line per key when key is NULL, a block's keys, or all about one key
 * ("fluid.size", "bodies.density"; a last part alone will do). Errors: SILT_INPUT, no such key, with the nearest. */
silt_status silt_scene_help(const char *key, FILE *to, silt_error *err);
/** The resolved scene with other names for the files that it reads; owned by the caller.
 * @param name  called with every file in the order of the text: what is written in its place, valid until the next call */
typedef const char *silt_file_name(void *self, const char *path);
char *silt_scene_named(const silt_scene *scene, silt_file_name *name, void *self);
/** Prints docs/scene.md: every key of the table in markdown. */
void silt_scene_document(FILE *to);

#endif
