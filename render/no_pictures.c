// A build without pictures: functions that would draw return this as a message. Verbs refuse such outputs before they begin (output_plan_picture).
#include "render/film.h"
#include "render/message.h"
#include "render/picture.h"
#include "render/replay_window.h"
#include "render/trainer.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"

#define PICTURE(function, ...)                                                                                                                                 \
    bool function(const char *path, const PictureOptions *options, __VA_ARGS__, char *message, size_t capacity)                                                \
    {                                                                                                                                                          \
        return message_fail(message, capacity, "this build has no pictures");                                                                                  \
    }

PICTURE(picture_of_run, const PictureScene *scene, const PictureTool *tool)
PICTURE(picture_of_moments, const PictureScene *scene, int tool_count, const PictureTool *tool)
PICTURE(picture_of_tree, const int size[3], Vec3 origin, const Vec3 axis[3], const float *value, float low, float high, const VesselTree *tree, int mark_count,
        const PictureMark *mark)
PICTURE(picture_of_fit, const ModelField *model, const TriangleMesh *mesh, const double *distance)
PICTURE(picture_of_error, const ModelField *model, const TriangleMesh *mesh, const double *error, double voxel_mm)
PICTURE(picture_of_junctions, const PictureJunctions *what, int *pages)
PICTURE(picture_of_series, int count, const double *time_s, int panel_count, const PicturePanel *panel, int event_count, const PictureEvent *event)

FilmOptions film_default_options(void) { return (FilmOptions){0}; }

#define WINDOW(type, function, refused, ...)                                                                                                                   \
    type function(__VA_ARGS__, Faults *faults)                                                                                                                 \
    {                                                                                                                                                          \
        faults_add(faults, "replay", 0, 0, "this build has no window; --verify and --scene work, or build with -DSELDINGER_RENDER=ON");                        \
        return refused;                                                                                                                                        \
    }

WINDOW(bool, film_picture, false, const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open)
WINDOW(bool, film_movie, false, const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open)
WINDOW(bool, replay_window_run, false, const ReplayWindowOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, bool *resumes,
       double *resume_s)
WINDOW(int, trainer_run, EXIT_BAD_INPUT, Scene *scene, OpenVessel *open, const TrainerOptions *options, TrainerFigures *figures)
