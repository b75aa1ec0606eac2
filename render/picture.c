// Options. The pictures: picture_run.c, picture_tree.c, picture_fit.c, picture_series.c.
#include "render/picture.h"

PictureOptions picture_default_options(void) { return (PictureOptions){.width = 1600, .height = 1000, .inset = true, .worst_count = 9, .arrows = true}; }
