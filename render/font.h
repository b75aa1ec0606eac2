// Letters for Dear ImGui, C++ only: DejaVu Sans where it is installed (package fonts-dejavu-core), else ImGui's own.
#ifndef SELDINGER_RENDER_FONT_H
#define SELDINGER_RENDER_FONT_H

#include <cstdio>
#include <imgui.h>

// `letters`: pairs of first and last code point, ended by 0; lives as long as the atlas. Once for each size, into the current context's atlas.
inline ImFont *font_add(float pixels, const ImWchar *letters, ImFontConfig config = ImFontConfig())
{
    static const char *const file[] = {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf",
                                       "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf"};
    config.SizePixels = pixels;
    ImFontAtlas *atlas = ImGui::GetIO().Fonts;
    for (const char *name : file)
        if (FILE *probe = std::fopen(name, "rb")) {   // ImGui asserts on a file that does not exist
            std::fclose(probe);
            return atlas->AddFontFromFileTTF(name, pixels, &config, letters);
        }
    return atlas->AddFontDefault(&config);
}

#endif
