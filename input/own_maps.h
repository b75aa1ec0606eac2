// The user's own device maps: devices/*.yaml in the configuration folder (base/folders.h). The page of devices writes them; `nav` uses them.
#ifndef SELDINGER_INPUT_OWN_MAPS_H
#define SELDINGER_INPUT_OWN_MAPS_H

#include "base/base.h"
#include "input/device_map.h"

// Loads at most `most` maps, in the order of their names, and returns their number. The caller frees each. Files that are no maps are faults and are left out.
int own_maps_load(DeviceMap **map, int most, Faults *faults);
// The file of a device's own map. The caller frees it; NULL: no home is known.
char *own_map_file(int vendor_id, int product_id);
// Writes an own map. False with faults.
bool own_map_save(int vendor_id, int product_id, const char *text, Faults *faults);

#endif
