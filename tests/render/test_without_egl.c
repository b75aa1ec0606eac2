// If EGL finds no driver or there is no EGL (the environment set in CMakeLists.txt hides them), every picture reports it and the program continues.
#include "render/gl_context.h"
#include "render/picture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static void pictures_fail_with_a_reason(void **state)
{
    (void)state;
    if (!getenv("__EGL_VENDOR_LIBRARY_DIRS"))
        skip();   // run by hand, outside ctest
    char message[256] = "";
    assert_null(gl_context_create(message, sizeof message));
    assert_non_null(strstr(message, "EGL"));

    const char *path = "/tmp/seldinger_test_without_egl.png";
    const Vec3 position[2] = {{0, 0, 0}, {1, 0, 0}};
    const double radius[2] = {0.1, 0.1}, time[2] = {0, 1}, value[2] = {0, 1};
    PictureTool tool = {.node_count = 2, .position = position, .radius = radius};
    PictureScene scene = {0};
    PictureOptions options = picture_default_options();
    message[0] = 0;
    assert_false(picture_of_run(path, &options, &scene, &tool, message, sizeof message));
    assert_non_null(strstr(message, "EGL"));
    PictureLine line = {"a", value};
    PicturePanel panel = {.title = "a", .line_count = 1, .line = &line};
    assert_false(picture_of_series(path, &options, 2, time, 1, &panel, 0, NULL, NULL, 0));
    assert_int_equal(access(path, F_OK), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(pictures_fail_with_a_reason)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
