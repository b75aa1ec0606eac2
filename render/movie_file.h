// A movie through ffmpeg: H.264 in MP4, yuv420p, that any player opens. Frames are piped to a child process; the file is renamed into place when
// complete. Unfinished files (after an error, SIGINT, SIGTERM, SIGHUP) are removed. A movie belongs to one thread. The same frames give the same
// bytes on one machine (one encoder thread, no time stamps, no version marks).
#ifndef SELDINGER_RENDER_MOVIE_FILE_H
#define SELDINGER_RENDER_MOVIE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct MovieFile MovieFile;

// `width`, `height` 2 to 8192 pixel (an odd size gets its last column or row twice: H.264 wants even ones), `fps` above 0, to 1000. NULL with a
// reason in `message`: ffmpeg not installed, path not writable, invalid size. Create it before drawing frames, which may take long.
MovieFile *movie_file_create(const char *path, int width, int height, double fps, char *message, size_t capacity);
// `rgb` (height, width, 3), rows from the top. False once ffmpeg has ended (a full disk, killed): movie_file_close says why.
bool movie_file_add(MovieFile *movie, const uint8_t *rgb);
int movie_file_count(const MovieFile *movie);   // frames so far
// Ends, renames, frees. False with ffmpeg's last message in `message` if there is no movie; an older file at the path is then unchanged.
bool movie_file_close(MovieFile *movie, char *message, size_t capacity);
// Discards the movie.
void movie_file_abandon(MovieFile *movie);

#endif
