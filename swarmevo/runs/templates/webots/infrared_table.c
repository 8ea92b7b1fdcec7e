
#define SWARMEVO_POINTS $points
/* What the world's sensors return at a distance [m], falling. */
static const double returned[SWARMEVO_POINTS][2] = {
$returned};
/* What the robot evolved with: readings over distance. */
static const double evolved[$evolved_points][2] = {
$evolved};

static double infrared_distance(double value) {
    int i;
    if (value >= returned[0][1]) return returned[0][0];
    for (i = 1; i < SWARMEVO_POINTS; ++i)
        if (value > returned[i][1])
            return returned[i - 1][0] + (value - returned[i - 1][1]) / (returned[i][1] - returned[i - 1][1]) *
                                            (returned[i][0] - returned[i - 1][0]);
    return INFINITY; /* nothing is in range */
}

static double infrared_reading(double distance) {
    int i;
    if (distance <= evolved[0][0]) return 1.0;
    for (i = 1; i < $evolved_points; ++i)
        if (distance <= evolved[i][0])
            return (evolved[i - 1][1] + (distance - evolved[i - 1][0]) / (evolved[i][0] - evolved[i - 1][0]) *
                                            (evolved[i][1] - evolved[i - 1][1])) /
                   evolved[0][1];
    return 0.0;
}
