
/* The sector of equal width in which something lies; the first is centred ahead, the others follow to the left. */
static int sector_of(double x, double y, int sectors) {
    const double turns = atan2(y, x) / 6.283185307179586 + 0.5 / sectors;
    const int sector = (int)((turns - floor(turns)) * sectors);
    return sector < sectors ? sector : sectors - 1;
}
