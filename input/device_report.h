// Prints a list of devices (input/device_list.h) for readers and as JSON.
#ifndef SELDINGER_INPUT_DEVICE_REPORT_H
#define SELDINGER_INPUT_DEVICE_REPORT_H

#include "input/device_list.h"

#include <stdio.h>

void device_list_print(FILE *out, const DeviceList *list);
char *device_list_json(const DeviceList *list);      // the caller frees it; NULL if out of memory

#endif
