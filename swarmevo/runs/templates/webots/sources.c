
#define SWARMEVO_SOURCES $sources
#define SWARMEVO_CHANNELS $channels
/* The scene's emitters; one row more, for C has no empty arrays. */
static const struct {
    int channel; /* -1: a light */
    double least, most; /* signal strength */
} sources[SWARMEVO_SOURCES + 1] = {
$source_rows    {-1, 0.0, 0.0}};
