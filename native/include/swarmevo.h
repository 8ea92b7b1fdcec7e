/* SPDX-License-Identifier: BSD-3-Clause
 *
 * The whole C ABI of libswarmevo. Valid C11 and C++; Python reads the part between the two markers with cffi.
 *
 * Conventions
 *   - Units are SI (metre, kilogram, second, newton, radian) unless a name says otherwise (`_deg`: degrees).
 *   - World frame: origin at the arena's centre on the floor, x east, y north, z up. Headings count counter-clockwise
 *     from +x. A robot's own frame: x forward, y to its left.
 *   - Outputs come first, then the object, then inputs. The caller owns every buffer; arrays are flat, row-major.
 *   - Every fallible function returns swe_status. On failure swe_error_message() holds one line for the calling thread.
 *   - swe_<struct>_init fills a struct with "not set" (NaN, -1, NULL): a field left so is an error that names it. The
 *     library has no defaults; they are the caller's.
 *   - A scene is immutable and may be shared by threads. A batch belongs to one thread at a time.
 */
#ifndef SWARMEVO_H
#define SWARMEVO_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#pragma GCC visibility push(default)
#endif
#ifdef __cplusplus
extern "C" {
#endif

/* [cffi begins] No preprocessor directives but plain integer constants from here to the end marker. */

#define SWE_ABI_VERSION 7

#define SWE_MAX_ROBOTS 64
#define SWE_MAX_DEVICES 16 /* in a robot's list of sensors */
#define SWE_MAX_INFRARED 64
#define SWE_MAX_TOUCH 16
#define SWE_MAX_CURVE_POINTS 16
#define SWE_MAX_CORNERS 32
#define SWE_MAX_MOVABLES 32
#define SWE_MAX_OBSTACLES 64
#define SWE_MAX_EMITTERS 16
#define SWE_MAX_PATCHES 32
#define SWE_MAX_GOALS 8
#define SWE_MAX_SECTORS 32
#define SWE_MAX_MESSAGE 16 /* bits */
#define SWE_MAX_GROUND 8

/* ---- status ---- */

typedef int32_t swe_status;
#define SWE_OK 0
#define SWE_INVALID_ARGUMENT 1 /* a value, size or pointer is wrong; nothing was done */
#define SWE_PHYSICS_ERROR 2    /* ODE failed, or the state is no longer finite */
#define SWE_POLICY_ERROR 3     /* a controller's output is not finite */
#define SWE_OUT_OF_MEMORY 4
#define SWE_INTERNAL_ERROR 5

/* One line about the calling thread's last failed call; "" after a call that succeeded. Valid until the next call. */
const char* swe_error_message(void);

/* ---- library ---- */

uint32_t swe_abi_version(void);

/* Release, compiler, ODE and Eigen versions and the beginning of a hash of the sources, in one line. */
const char* swe_build_info(void);

/* Sizes in bytes of swe_scene_config, swe_network_config, swe_policy, swe_episode, swe_outcome, swe_channel_info,
 * swe_channel, swe_linear_config, swe_recurrent_config, in this order: a caller compiled against another header finds
 * out before anything goes wrong. */
#define SWE_LAYOUT_SIZES 9
void swe_abi_layout(uint32_t sizes[SWE_LAYOUT_SIZES]);

/* Provokes an assertion inside ODE. A sound library returns SWE_PHYSICS_ERROR; nothing else is touched. */
swe_status swe_selftest_ode_error(void);

/* ---- scene ---- */

typedef struct swe_arena_config {
    int32_t shape;                      /* SWE_ARENA_SHAPE_* */
    double size[2];                     /* rectangle: inner sides along x, y; circle: inner diameter, twice [m] */
    double corners[SWE_MAX_CORNERS][2]; /* polygon: x, y [m], counter-clockwise; convex */
    uint32_t n_corners;                 /* polygon: 3 to SWE_MAX_CORNERS */
    double wall_height;                 /* [m] */
} swe_arena_config;

#define SWE_ARENA_SHAPE_RECTANGLE 1
#define SWE_ARENA_SHAPE_CIRCLE 2
#define SWE_ARENA_SHAPE_POLYGON 3

/* What robots can push. It stands on four feet: a box on its corners, a cylinder on its rim. */
typedef struct swe_movable_config {
    int32_t shape;          /* SWE_SHAPE_* */
    double size[3];         /* box: along its own x, y, z; cylinder: diameter, diameter, height [m] */
    double mass;            /* [kg] */
    double friction;        /* Coulomb coefficient with the floor */
    double feet;            /* where they stand: share of the way from the middle to the corners or the rim */
    double pose[3];         /* x [m], y [m], heading [rad] of its centre at the start */
    double velocity[3];     /* x [m/s], y [m/s], about the vertical [rad/s] at the start */
    int32_t start;          /* SWE_START_POSES: at its pose; SWE_START_RANDOM: anywhere in start_region */
    double start_region[4]; /* x from, x to, y from, y to [m] of its centre; read by SWE_START_RANDOM alone */
} swe_movable_config;

#define SWE_SHAPE_BOX 1
#define SWE_SHAPE_CYLINDER 2

/* What never moves, beside the arena's walls. Robots' rays see it. */
typedef struct swe_obstacle_config {
    int32_t shape;  /* SWE_SHAPE_* */
    double size[3]; /* as a movable's [m] */
    double pose[3]; /* x [m], y [m], heading [rad] of its centre */
} swe_obstacle_config;

typedef struct swe_emitter_config {
    uint32_t channel;   /* below SWE_MAX_EMITTERS, or that of lights; robots hear the strongest of each */
    int32_t rides_on;   /* the movable that carries it, or SWE_NOTHING */
    double position[3]; /* [m], in the world; in the movable's own frame if it rides on one */
    double range;       /* [m] */
    double strength[2]; /* smallest and largest signal strength S */
    int32_t reach;      /* SWE_REACH_* */
} swe_emitter_config;

#define SWE_CHANNEL_LIGHT 16 /* of lights, which light sensors alone perceive */
#define SWE_NOTHING 1000     /* no movable */

#define SWE_REACH_RANGE 1 /* heard within `range` only; S is the smallest strength outside */
#define SWE_REACH_ARENA 2 /* heard everywhere */

/* A patch of the floor in another grey; of two that overlap the later one is on top. */
typedef struct swe_patch_config {
    int32_t shape;  /* SWE_SHAPE_*: a rectangle or a disc */
    double size[2]; /* along its own x, y, or diameter, twice [m] */
    double pose[3]; /* x [m], y [m], heading [rad] of its centre */
    double grey;    /* 0 black to 1 white */
} swe_patch_config;

typedef struct swe_ground_config {
    double grey; /* of the floor beside the patches */
    swe_patch_config patches[SWE_MAX_PATCHES];
    uint32_t n_patches;
} swe_ground_config;

/* Where movables are to be brought: a wall of a rectangular arena, reached when the movable touches it, or a region of
 * the floor, reached when the movable's centre lies in it. */
typedef struct swe_goal_config {
    int32_t kind;     /* SWE_GOAL_* */
    double region[4]; /* x from, x to, y from, y to [m]; read by SWE_GOAL_REGION alone */
} swe_goal_config;

#define SWE_GOAL_NORTH 1 /* the wall y = +size/2 */
#define SWE_GOAL_SOUTH 2
#define SWE_GOAL_EAST 3 /* x = +size/2 */
#define SWE_GOAL_WEST 4
#define SWE_GOAL_REGION 5

typedef struct swe_robot_config {
    double radius;                    /* of the body, to the rim of its bumper [m] */
    double height;                    /* top of the body above the floor [m] */
    double mass;                      /* [kg] */
    double centre_of_mass;            /* height above the floor [m] */
    double wheel_radius;              /* [m] */
    double axle_length;               /* between the wheels' contact points [m] */
    double top_speed;                 /* of a wheel [rad/s] */
    double motor_torque;              /* largest of a wheel's motor [N m]; read by SWE_DRIVE_ARTICULATED alone */
    double caster_offset;             /* front and rear caster, ahead of and behind the axle [m] */
    double caster_clearance;          /* between casters and floor when upright [m] */
    double bumper_stiffness;          /* of the sprung bumper [N/m] */
    double bumper_damping;            /* [N s/m] */
    double bumper_travel;             /* from its rim, which is the body's radius, inwards to a rigid stop [m] */
    int32_t bumper;                   /* SWE_BUMPER_*; a rigid one does not read the three before */
    int32_t sensors[SWE_MAX_DEVICES]; /* SWE_SENSOR_*, each once: an observation has their readings in this order */
    uint32_t sensor_count;            /* of these; 0: a robot observes nothing */
} swe_robot_config;

#define SWE_SENSOR_INFRARED 1   /* infrared_count readings in [0, 1] */
#define SWE_SENSOR_TOUCH 2      /* touch_count readings in [0, 1] */
#define SWE_SENSOR_RF 3         /* for each channel signal strength S over the largest */
#define SWE_SENSOR_RF_BEARING 4 /* for each channel cosine and sine of the bearing; 0, 0 where it is not heard */
#define SWE_SENSOR_RANGE_AND_BEARING                                                                        \
    5                         /* in each sector: 1 - distance / range of the nearest robot, and its message \
                               */
#define SWE_SENSOR_GROUND 6   /* ground_count grey values of the floor, 0 black to 1 white */
#define SWE_SENSOR_ODOMETRY 7 /* left and right wheel's speed over the top speed, in the last control step */
#define SWE_SENSOR_MOVABLE_MOTION \
    8                      /* of the movable that is touched: ahead, left, spin, over the robot's fastest; or 0 */
#define SWE_SENSOR_LIGHT 9 /* in each sector: strength of the strongest light over its largest; 0 without one */

#define SWE_BUMPER_SPRUNG 1 /* meets box, walls and other robots softly, all round the body */
#define SWE_BUMPER_RIGID 2

typedef struct swe_team_config {
    uint32_t robots;           /* 1 to SWE_MAX_ROBOTS */
    int32_t start;             /* SWE_START_* */
    const double* start_poses; /* (robots, 3): x [m], y [m], heading [rad]; read by SWE_START_POSES alone, copied */
    double start_region[4];    /* x from, x to, y from, y to [m] of robots' centres; read by SWE_START_RANDOM alone */
    double start_jitter[2];    /* largest deviation of position [m] and heading [rad], drawn uniformly */
} swe_team_config;

#define SWE_START_POSES 1  /* start_poses, each disturbed by start_jitter */
#define SWE_START_RANDOM 2 /* anywhere in start_region, any heading, nobody inside anything */

typedef struct swe_sensors_config {
    double infrared_yaw_deg[SWE_MAX_INFRARED];      /* bearings of the rays, left positive [deg] */
    uint32_t infrared_count;                        /* of these, 1 to SWE_MAX_INFRARED */
    double infrared_curve[SWE_MAX_CURVE_POINTS][2]; /* distance [m], raw value; increasing; 0 beyond the last */
    uint32_t infrared_curve_points;                 /* 2 to SWE_MAX_CURVE_POINTS */
    int32_t infrared_target;                        /* SWE_INFRARED_TARGET_* */
    double touch_yaw_deg[SWE_MAX_TOUCH];            /* bearings of the sectors' centres, left positive [deg] */
    uint32_t touch_count;                           /* of these, 1 to SWE_MAX_TOUCH */
    double touch_half_width_deg;                    /* of each sector [deg] */
    double touch_range;                             /* between body and box [m] */
    int32_t touch_mode;                             /* SWE_TOUCH_MODE_* */
    double range_and_bearing_range;                 /* between robots' centres [m] */
    uint32_t range_and_bearing_sectors;        /* 1 to SWE_MAX_SECTORS; the first is centred ahead, then leftwards */
    uint32_t range_and_bearing_message;        /* bits that a robot sends: further commands; 0 to SWE_MAX_MESSAGE */
    double ground_position[SWE_MAX_GROUND][2]; /* of the sensors, ahead and to the left of the axle's middle [m] */
    uint32_t ground_count;                     /* of these, 1 to SWE_MAX_GROUND */
    uint32_t light_sectors;                    /* 1 to SWE_MAX_SECTORS, as those of range and bearing */
} swe_sensors_config;

#define SWE_INFRARED_TARGET_WALLS_AND_ROBOTS 1
#define SWE_INFRARED_TARGET_ALL 2 /* the box too */

#define SWE_TOUCH_MODE_BINARY 1 /* 1 where the box is within touch_range, else 0 */
#define SWE_TOUCH_MODE_GRADED 2 /* 1 - distance / touch_range */
#define SWE_TOUCH_MODE_FORCE 3  /* normal force on the box over the robot's traction limit, at most 1 */

typedef struct swe_noise_config {
    double infrared;            /* relative standard deviation of a reading, Gaussian */
    double infrared_at_contact; /* the same at distance 0; linear in between over the curve's first interval */
    double wheels;              /* largest relative error of a wheel's speed, uniform */
    double rf;                  /* relative standard deviation of S, Gaussian */
    double rf_bearing;          /* standard deviation of the bearing, Gaussian [rad] */
    double range_and_bearing;   /* relative standard deviation of a distance, Gaussian */
    double ground;              /* standard deviation of a grey value, Gaussian */
    double odometry;            /* relative standard deviation of a speed, Gaussian */
    double light;               /* relative standard deviation of a strength, Gaussian */
} swe_noise_config;

typedef struct swe_physics_config {
    double time_step;      /* [s] */
    double gravity;        /* [m/s^2] */
    double wheel_friction; /* Coulomb coefficient wheel-floor */
    double side_friction;  /* between robots, movables, obstacles and walls */
    double contact_erp;    /* ODE's error reduction parameter of contacts */
    double contact_cfm;    /* ODE's constraint force mixing of contacts [s/kg] */
    int32_t drive;         /* SWE_DRIVE_* */
} swe_physics_config;

#define SWE_DRIVE_DRIVEN_CONTACTS 1 /* a robot is one body, its wheels are moving contact surfaces */
#define SWE_DRIVE_ARTICULATED 2     /* chassis and two wheels on hinges with motors: the reference, slower */

typedef struct swe_episode_config {
    double horizon;        /* [s], a whole number of control periods */
    double control_period; /* [s], a whole number of time steps */
    int32_t until;         /* SWE_UNTIL_* */
} swe_episode_config;

#define SWE_UNTIL_HORIZON 1
#define SWE_UNTIL_PUSH 2 /* the control step at whose end all movables have been at a goal is the last one */

typedef struct swe_scene_config {
    uint32_t struct_size;
    swe_arena_config arena;
    swe_movable_config movables[SWE_MAX_MOVABLES];
    uint32_t n_movables;
    swe_obstacle_config obstacles[SWE_MAX_OBSTACLES];
    uint32_t n_obstacles;
    swe_emitter_config emitters[SWE_MAX_EMITTERS];
    uint32_t n_emitters;
    swe_ground_config ground;
    swe_goal_config goals[SWE_MAX_GOALS];
    uint32_t n_goals;
    swe_robot_config robot;
    swe_team_config team;
    swe_sensors_config sensors;
    swe_noise_config noise;
    swe_physics_config physics;
    swe_episode_config episode;
} swe_scene_config;

void swe_scene_config_init(swe_scene_config* config);

typedef struct swe_scene swe_scene;

/* Fails with SWE_INVALID_ARGUMENT and every error of the config in one message, separated by "; ". */
swe_status swe_scene_create(swe_scene** scene, const swe_scene_config* config);
void swe_scene_destroy(swe_scene* scene); /* NULL is fine; batches made from it keep what they need */

uint32_t swe_scene_robots(const swe_scene* scene);
uint32_t swe_scene_control_steps(const swe_scene* scene);
uint32_t swe_scene_movables(const swe_scene* scene);
uint32_t swe_scene_observations(const swe_scene* scene); /* numbers in a robot's observation */
uint32_t swe_scene_commands(const swe_scene* scene);     /* in its command: left wheel, right wheel, then
                                                            a message bit each: set where above 0 */

/* ---- policies ---- */

/* A controller that runs inside the worker threads.
 *   parameters   as given in swe_policy; shared between threads, not to be written
 *   observation  the scene's values, swe_scene_observations of them
 *   memory       swe_policy.memory doubles of this robot alone, zero when the episode starts
 *   command      swe_scene_commands values to write; the library clips them to [-1, 1]: of the top speed, then bits
 */
typedef void (*swe_policy_function)(const void* parameters, const double* observation, double* memory, double* command);

typedef struct swe_policy {
    swe_policy_function function;
    const void* parameters;
    uint32_t memory;
    uint32_t observations, commands; /* of the scenes that it is for, others refuse it; 0: whatever a scene has */
} swe_policy;

typedef struct swe_network_config {
    uint32_t struct_size;
    uint32_t hidden;       /* units in a genome, on or off: 0 to 1024 */
    int32_t bias;          /* 1: a constant input to hidden and output units; 0: none */
    int32_t activation;    /* SWE_ACTIVATION_* */
    uint32_t observations; /* of the scenes that they are for: 0 to 1024 */
    uint32_t commands;     /* likewise: 1 to 1024 */
} swe_network_config;

#define SWE_ACTIVATION_TANH 1
#define SWE_ACTIVATION_LOGISTIC 2 /* outputs are stretched to [-1, 1] */

void swe_network_config_init(swe_network_config* config);

/* Feed-forward networks with one hidden layer; units switched off cost nothing. */
typedef struct swe_networks swe_networks;

/* Copies n networks.
 *   input_hidden   (n, hidden, observations + bias)
 *   hidden_output  (n, commands, hidden + bias)
 *   hidden_switch  (n, hidden): 0 is off
 */
swe_status swe_networks_create(swe_networks** networks, const swe_network_config* config, size_t n,
                               const double* input_hidden, const double* hidden_output, const uint8_t* hidden_switch);
void swe_networks_destroy(swe_networks* networks);

/* Writes n policies, valid as long as `networks` lives. */
swe_status swe_networks_policies(swe_policy* policies, size_t capacity, const swe_networks* networks);

/* Networks of other kinds are swe_networks, too: swe_networks_destroy and swe_networks_policies take them. */

#define SWE_ACTIVATION_IDENTITY 3 /* of swe_linear_config alone */

typedef struct swe_linear_config {
    uint32_t struct_size;
    int32_t bias;          /* 1: a constant input; 0: none */
    int32_t activation;    /* SWE_ACTIVATION_* */
    uint32_t observations; /* of the scenes that they are for: 0 to 1024 */
    uint32_t commands;     /* likewise: 1 to 1024 */
} swe_linear_config;

void swe_linear_config_init(swe_linear_config* config);

/* Copies n networks without hidden units.
 *   input_output  (n, commands, observations + bias)
 */
swe_status swe_linear_create(swe_networks** networks, const swe_linear_config* config, size_t n,
                             const double* input_output);

typedef struct swe_recurrent_config {
    uint32_t struct_size;
    uint32_t hidden;       /* units in a genome, on or off: 0 to 1024 */
    int32_t bias;          /* 1: a constant input to hidden and output units; 0: none */
    int32_t activation;    /* SWE_ACTIVATION_TANH or SWE_ACTIVATION_LOGISTIC */
    uint32_t observations; /* of the scenes that they are for: 0 to 1024 */
    uint32_t commands;     /* likewise: 1 to 1024 */
    int32_t recurrence;    /* SWE_RECURRENCE_* */
    int32_t integration;   /* SWE_INTEGRATION_*; read by SWE_RECURRENCE_CTRNN alone, as is the next */
    double control_period; /* [s] */
} swe_recurrent_config;

/* What hidden units hear besides the observation: the context, zero when the episode starts. */
#define SWE_RECURRENCE_ELMAN 1  /* the hidden units a control step ago */
#define SWE_RECURRENCE_JORDAN 2 /* the command a control step ago */
#define SWE_RECURRENCE_CTRNN 3  /* the hidden units, which are leaky integrators: tau dy/dt = -y + what they hear */

#define SWE_INTEGRATION_EXPONENTIAL 1 /* exact while what a unit hears stands still */
#define SWE_INTEGRATION_EULER 2       /* a step of Euler's; no time constant may be shorter than the control period */

void swe_recurrent_config_init(swe_recurrent_config* config);

/* Copies n networks with one hidden layer and a memory.
 *   input_hidden    (n, hidden, observations + bias)
 *   context_hidden  (n, hidden, context); the context is as large as hidden, or commands: SWE_RECURRENCE_JORDAN
 *   hidden_output   (n, commands, hidden + bias)
 *   time_constants  (n, hidden) [s]; read by SWE_RECURRENCE_CTRNN alone, else NULL is fine
 *   hidden_switch   (n, hidden): 0 is off
 */
swe_status swe_recurrent_create(swe_networks** networks, const swe_recurrent_config* config, size_t n,
                                const double* input_hidden, const double* context_hidden, const double* hidden_output,
                                const double* time_constants, const uint8_t* hidden_switch);

/* ---- episodes ---- */

/* Everything random in an episode is a pure function of these, of the robot and of the control step. */
typedef struct swe_episode {
    uint64_t seed;
    uint32_t trial; /* below 65536 */
    uint32_t generation;
    uint32_t repeat; /* below 65536 */
} swe_episode;

typedef struct swe_outcome {
    int32_t status;          /* swe_status of this episode; all else is meaningless unless SWE_OK */
    uint32_t ode_messages;   /* warnings of ODE's solver; each makes a step be tried again */
    uint32_t unsolved_steps; /* steps that no further try mended */
    uint32_t control_steps;  /* done: those of the horizon at the end of an episode, or fewer: SWE_UNTIL_PUSH */
    uint64_t hash;           /* of every body's state at every control step */
    double push_time;        /* when the last movable has been at a goal [s]; NaN: not all of them, or none is there */
    double box_pose[3];      /* of the first movable at the end: x [m], y [m], heading [rad]; NaN without one */
    double max_penetration;  /* deepest overlap of any two bodies, walls or floor, beyond bumpers' travel [m] */
    double max_lift;         /* largest rise of any body's centre above its resting height [m] */
    double min_upright;      /* smallest cosine of any body's tilt; below 0.5 a robot has fallen */
} swe_outcome;

/* What can be recorded of an episode, at each control step, before the command acts. docs/channels.md says what each
 * channel means; the table is the library's, so that a caller can compare it with its own. */
typedef struct swe_channel_info {
    const char* name;  /* valid as long as the library */
    int32_t per_robot; /* 1: values of each robot; 0: of the world */
    uint32_t width;    /* values, of each robot or of the world */
} swe_channel_info;

uint32_t swe_channel_count(void);

/* Of a channel below swe_channel_count(), in a scene; NULL: any, in which a width that differs between scenes is 0. */
swe_status swe_channel_describe(swe_channel_info* info, uint32_t channel, const swe_scene* scene);

/* A channel that is wanted, and where to. */
typedef struct swe_channel {
    const char* name;
    double* values; /* (episodes, control steps, robots, width), without robots where the channel is of the world */
    size_t length;  /* in doubles; must be exact */
} swe_channel;

typedef struct swe_batch swe_batch;

/* A batch of several threads is of the process that made it: in a fork of that the functions below refuse it. */
swe_status swe_batch_create(swe_batch** batch, const swe_scene* scene, uint32_t threads);
void swe_batch_destroy(swe_batch* batch);

/* Runs n episodes to their end over the batch's threads. The same episodes give the same bits on any number of
 * threads, in any order or division into calls.
 *   outcomes       n
 *   homing_times   (n, robots): first time a robot's centre is within the emitter's range [s]; NaN: never
 *   channels       n_channels of them; NULL and 0: none. Steps after the end of an episode are NaN
 *   robot_policies (n, robots): index into policies
 * An episode that fails leaves its reason in its outcome and in swe_batch_episode_message; the call returns SWE_OK. */
swe_status swe_batch_run(swe_outcome* outcomes, double* homing_times, const swe_channel* channels, size_t n_channels,
                         swe_batch* batch, const swe_episode* episodes, size_t n, const swe_policy* policies,
                         size_t n_policies, const uint32_t* robot_policies);

/* "" or why episode i of the last run or lockstep failed. */
const char* swe_batch_episode_message(const swe_batch* batch, size_t episode);

/* Lockstep, for controllers outside the library: begin, then the others in any order, as a rule observe and advance in
 * turn, then end. A world keeps its own count of control steps, and what it does never depends on the others. One that
 * has failed or is at its horizon stands still until it is reset. The channels' buffers must outlive the end. */
swe_status swe_lockstep_begin(swe_batch* batch, const swe_channel* channels, size_t n_channels,
                              const swe_episode* episodes, size_t n);

/* What robots sense now, (n, robots, swe_scene_observations); zeros where the world has failed. */
swe_status swe_lockstep_observe(double* observations, size_t length, swe_batch* batch);

/* Lets commands (n, robots, swe_scene_commands) act for one control period. SWE_INVALID_ARGUMENT if no world can go on.
 */
swe_status swe_lockstep_advance(swe_batch* batch, const double* commands, size_t length);

/* Worlds that can go on, and worlds that have failed; the others are at their horizon. */
swe_status swe_lockstep_count(uint32_t* movable, uint32_t* failed, const swe_batch* batch);

/* Begins n new episodes in n worlds, none named twice; what is recorded of them begins anew. One that cannot begin
 * has failed: its reason is in its outcome and in swe_batch_episode_message. */
swe_status swe_lockstep_reset(swe_batch* batch, const uint32_t* worlds, const swe_episode* episodes, size_t n);

/* All worlds at this moment, of which nothing changes.
 *   outcomes      n, as if the episodes ended now; NULL: not wanted
 *   homing_times  (n, robots); NULL: not wanted
 *   channels      n_channels of them, of one control step; NaN where the world has failed, as is the command before the
 *                 first step */
swe_status swe_lockstep_state(swe_outcome* outcomes, double* homing_times, const swe_channel* channels,
                              size_t n_channels, swe_batch* batch);

swe_status swe_lockstep_end(swe_outcome* outcomes, double* homing_times, swe_batch* batch);

/* [cffi ends] */

#ifdef __cplusplus
}
#endif
#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
