// Dear ImGui 1.86 with its OpenGL 3 back end, used for its draw list only. No window, no ini file, no clock.
#include "render/overlay.h"

#include "render/font.h"
#include "render/imgui_heap.h"

#include <cstdint>
#include <imgui.h>
#include <backends/imgui_impl_opengl3.h>
#include <new>

struct Overlay {
    ImGuiContext *context, *previous;
    ImDrawList *list;
    ImFont *font[TEXT_SIZES];
    bool has_backend;
};

static ImU32 packed(Color c) { return IM_COL32(c.r, c.g, c.b, c.a); }
static ImVec2 at(double x, double y) { return ImVec2((float)x, (float)y); }

extern "C" Overlay *overlay_create(int width, int height, float scale)
{
    static const float pixels[TEXT_SIZES] = {14, 17, 23};
    static const ImWchar letters[] = {0x20, 0x17f, 0x391, 0x3c9, 0x2010, 0x2027, 0x2190, 0x2193, 0x2212, 0x2212, 0};

    Overlay *overlay = new (std::nothrow) Overlay();
    if (!overlay)
        return nullptr;
    overlay->previous = ImGui::GetCurrentContext();
    imgui_use_heap();
    overlay->context = ImGui::CreateContext();
    ImGui::SetCurrentContext(overlay->context);
    ImGuiIO &io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.LogFilename = nullptr;
    io.DisplaySize = at(width, height);
    io.DeltaTime = 1.0f / 30;
    for (int i = 0; i < TEXT_SIZES; i++)
        overlay->font[i] = font_add(pixels[i] * scale, letters);
    overlay->has_backend = ImGui_ImplOpenGL3_Init("#version 330 core");
    if (!overlay->has_backend) {
        overlay_destroy(overlay);
        return nullptr;
    }
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
    overlay->list = ImGui::GetBackgroundDrawList();
    return overlay;
}

extern "C" void overlay_destroy(Overlay *overlay)
{
    if (!overlay)
        return;
    ImGui::SetCurrentContext(overlay->context);
    if (overlay->has_backend)
        ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext(overlay->context);
    ImGui::SetCurrentContext(overlay->previous);
    delete overlay;
}

extern "C" void overlay_finish(Overlay *overlay)
{
    ImGui::SetCurrentContext(overlay->context);
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

extern "C" void overlay_line(Overlay *overlay, double x0, double y0, double x1, double y1, Color color, double thickness)
{
    overlay->list->AddLine(at(x0, y0), at(x1, y1), packed(color), (float)thickness);
}

extern "C" void overlay_polyline(Overlay *overlay, int count, const float (*point)[2], Color color, double thickness)
{
    // ImGui's 16-bit indices limit a line to about 16,000 points
    const int most = 4000;
    for (int first = 0; first + 1 < count; first += most - 1) {
        int part = count - first < most ? count - first : most;
        overlay->list->AddPolyline(reinterpret_cast<const ImVec2 *>(point + first), part, packed(color), 0, (float)thickness);
    }
}

extern "C" void overlay_rectangle(Overlay *overlay, double x, double y, double width, double height, Color color, double thickness)
{
    overlay->list->AddRect(at(x, y), at(x + width, y + height), packed(color), 0, 0, (float)thickness);
}

extern "C" void overlay_fill(Overlay *overlay, double x, double y, double width, double height, Color color)
{
    overlay->list->AddRectFilled(at(x, y), at(x + width, y + height), packed(color));
}

extern "C" void overlay_circle(Overlay *overlay, double x, double y, double radius, Color color, double thickness)
{
    overlay->list->AddCircle(at(x, y), (float)radius, packed(color), 0, (float)thickness);
}

extern "C" void overlay_disc(Overlay *overlay, double x, double y, double radius, Color color)
{
    overlay->list->AddCircleFilled(at(x, y), (float)radius, packed(color));
}

extern "C" void overlay_text(Overlay *overlay, double x, double y, TextSize size, Color color, const char *text)
{
    ImFont *font = overlay->font[size];
    // whole pixels keep the letters sharp
    overlay->list->AddText(font, font->FontSize, ImVec2((float)(int)(x + 0.5), (float)(int)(y + 0.5)), packed(color), text);
}

extern "C" void overlay_text_size(Overlay *overlay, TextSize size, const char *text, double *width, double *height)
{
    ImFont *font = overlay->font[size];
    ImVec2 extent = font->CalcTextSizeA(font->FontSize, 1e9f, 0, text);
    if (width)
        *width = extent.x;
    if (height)
        *height = extent.y;
}

extern "C" void overlay_image(Overlay *overlay, unsigned texture, double x, double y, double width, double height, bool is_bottom_up)
{
    overlay->list->AddImage((ImTextureID)(intptr_t)texture, at(x, y), at(x + width, y + height), at(0, is_bottom_up ? 1 : 0), at(1, is_bottom_up ? 0 : 1));
}

extern "C" void overlay_push_clip(Overlay *overlay, double x, double y, double width, double height)
{
    overlay->list->PushClipRect(at(x, y), at(x + width, y + height), true);
}

extern "C" void overlay_pop_clip(Overlay *overlay) { overlay->list->PopClipRect(); }
