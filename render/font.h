// Fonts for Dear ImGui, C++ only: DejaVu Sans if it is installed (package fonts-dejavu-core), else ImGui's built-in font.
#ifndef SELDINGER_RENDER_FONT_H
#define SELDINGER_RENDER_FONT_H

#include <cstdio>
#include <imgui.h>

// Adds a font to the atlas of the current context; call once for each size. `letters`: pairs of first and last code point, ended by 0; must live as long as the
// atlas.
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
