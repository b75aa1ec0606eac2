// A running session in the browser of an instructor on this machine: one page with the window's picture and the score's figures, read-only, on 127.0.0.1. It has a
// thread of its own (libmicrohttpd). The window's thread hands pictures over without waiting: if the other thread holds the slot, the picture is dropped.
//     GET /  the page      /view.js  its script      /view.png  the latest picture      /score.json  the figures
#ifndef SELDINGER_RENDER_INSTRUCTOR_VIEW_H
#define SELDINGER_RENDER_INSTRUCTOR_VIEW_H

#include "sim/sim.h"

typedef struct InstructorView InstructorView;

// `port` 0: any free one. Returns NULL with a reason.
InstructorView *instructor_view_open(int port, char *message, size_t capacity);
void instructor_view_close(InstructorView *view);            // NULL is allowed
int instructor_view_port(const InstructorView *view);

// Whether a picture is wanted now: at most two a second, and none while no browser asks. NULL: never.
bool instructor_view_is_due(InstructorView *view);
// Where the window's thread stores the pixels (height, width, 3), rows from the top, before it shows them. NULL: out of memory.
uint8_t *instructor_view_pixels(InstructorView *view, int width, int height);

typedef struct InstructorFigures {
    const char *trainee;
    double simulated_s;
    bool is_paused;
    const ScoreFigures *score;
    const Scene *scene;
} InstructorFigures;
void instructor_view_show(InstructorView *view, const InstructorFigures *figures);

#endif
