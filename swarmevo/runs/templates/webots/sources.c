
#define SWARMEVO_SOURCES $sources
#define SWARMEVO_SIGNAL_MOST $signal_most
/* The scene's emitters; one row more, for C has no empty arrays. */
static const struct {
    int is_homed_in_on, is_light;
    double least, most; /* signal strength */
} sources[SWARMEVO_SOURCES + 1] = {
$source_rows    {0, 0, 0.0, 0.0}};
