// Writes a video through ffmpeg: H.264 in MP4, yuv420p, playable by any player. Frames are piped to a child process; the file is renamed to its final path when
// complete. Unfinished files (after an error, SIGINT, SIGTERM, SIGHUP) are removed. A MovieFile belongs to one thread. On one machine the same frames give the
// same
// bytes (one encoder thread, no time stamps, no version marks).
#ifndef SELDINGER_RENDER_MOVIE_FILE_H
#define SELDINGER_RENDER_MOVIE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct MovieFile MovieFile;

// `width`, `height`: 2 to 8192 pixels (H.264 needs even sizes: the last column or row of an odd size is doubled); `fps`: above 0, to 1000. Returns NULL with a
// reason in `message`: ffmpeg not installed, path not writable, invalid size. Create it before drawing frames, which may take long.
MovieFile *movie_file_create(const char *path, int width, int height, double fps, char *message, size_t capacity);
// `rgb` (height, width, 3), rows from the top. Returns false once ffmpeg has ended (disk full, killed); movie_file_close() then reports why.
bool movie_file_add(MovieFile *movie, const uint8_t *rgb);
int movie_file_count(const MovieFile *movie);   // number of frames so far
// Ends the video, renames and frees it. Returns false with ffmpeg's last message in `message` if there is no video; an existing file at the path is then
// unchanged.
bool movie_file_close(MovieFile *movie, char *message, size_t capacity);
// Discards the video.
void movie_file_abandon(MovieFile *movie);

#endif
