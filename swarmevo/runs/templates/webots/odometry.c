
static WbDeviceTag wheels[2];
static double angles[2]; /* at the last reading [rad] */
static double read_at; /* [s]; 0: not yet */

static void enable_odometry(int step) {
    wheels[0] = wb_robot_get_device("left wheel sensor");
    wheels[1] = wb_robot_get_device("right wheel sensor");
    if (wheels[0]) wb_position_sensor_enable(wheels[0], step);
    if (wheels[1]) wb_position_sensor_enable(wheels[1], step);
}

static double *sense_odometry(double *next) {
    const double now = wb_robot_get_time();
    int i;
    for (i = 0; i < 2; ++i) {
        const double angle = wheels[i] ? wb_position_sensor_get_value(wheels[i]) : 0.0;
        const double speed = read_at > 0.0 && now > read_at ? (angle - angles[i]) / (now - read_at) : 0.0;
        *next++ = limited(speed / SWARMEVO_TOP_SPEED, -1.0, 1.0);
        angles[i] = angle;
    }
    read_at = now;
    return next;
}
