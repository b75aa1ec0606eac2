// The tray of the trainer's panels: selection of a device.
#ifndef SELDINGER_RENDER_PANEL_TRAY_H
#define SELDINGER_RENDER_PANEL_TRAY_H

typedef struct Panel Panel;

void panel_move_in_tray(Panel *panel, int devices);      // moves the selection down, or up (< 0)
void panel_shape_in_tray(Panel *panel, int i, int steps);          // of the tip's length (0), angle (1) and mandrel (2)

#endif
