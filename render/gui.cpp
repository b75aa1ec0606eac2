// On a software renderer the cost is in blended pixels and triangles. Buttons, rows and bars are drawn here, square and without antialiasing, instead of by
// ImGui's widgets:
// a third of the triangles. KEPT windows are drawn into a texture only when their vertices have changed, and copied from
// there: 1 ms a frame instead of 5 at 1280x720.
#include "render/gui.h"

#include "render/font.h"
#include "render/imgui_heap.h"
#include "render/translation.h"

#include <cmath>
#include <cstring>
#include <epoxy/gl.h>
#include <imgui.h>
#include <imgui_internal.h>
#include <backends/imgui_impl_opengl3.h>
#include <new>
#include <utility>

enum { KEPT_WINDOWS = 16, SELDOM_FRAMES = 3 };

struct KeptWindow {
    ImGuiID id;
    ImDrawList *list;                // of this frame, NULL: not shown in it
    GuiRect at;
    bool is_seldom, is_drawn;
    uint64_t hash;                   // of the vertices drawn
    int age;                         // frames since
};

struct Gui {
    ImGuiContext *context, *previous;
    ImFont *font[GUI_FONTS];
    float scale;
    bool has_backend, is_silent;
    bool takes_text;                 // a text field of this frame has the keys
    bool scrolls_to_end;             // of the window begun last
    bool released[WINDOW_KEYS];
    KeptWindow kept[KEPT_WINDOWS];
    int kept_count;
    GLuint keep_texture, keep_framebuffer;
    int keep_width, keep_height;
    bool is_turned;                  // stored upside down, for a window
    int cut_count;                   // texts cut off in this frame
    char first_cut[200];
};

static constexpr Color rgb(int r, int g, int b) { return Color{(uint8_t)r, (uint8_t)g, (uint8_t)b, 255}; }
// marks: sky blue, bluish green, orange and vermilion of Okabe and Ito, lightened for a dark background
extern "C" const GuiColors gui_colors = {rgb(12, 14, 18),   rgb(23, 26, 32),    rgb(40, 45, 55),    rgb(56, 63, 77),   rgb(32, 84, 128),
                                         rgb(52, 58, 70),   rgb(222, 226, 233), rgb(146, 154, 168), rgb(86, 180, 233), rgb(40, 190, 145),
                                         rgb(240, 172, 30), rgb(255, 112, 64),  rgb(52, 102, 148),  rgb(60, 104, 140)};

// Of the key on a button; `is_bright`: the button is chosen or under the mouse.
static Color key_color(bool is_bright) { return is_bright ? gui_colors.text : gui_colors.dim; }

extern "C" int gui_contrasts(const GuiContrast **out)
{
    static const double text = 4.5, mark = 3;
    static const GuiColors &c = gui_colors;
    static const GuiContrast all[] = {
        {"text on windows", c.text, c.window, text},
        {"text on panels", c.text, c.panel, text},
        {"text on buttons", c.text, c.frame, text},
        {"text under the mouse", c.text, c.frame_hot, text},
        {"text on chosen buttons", c.text, c.frame_on, text},
        {"dim text on windows", c.dim, c.window, text},
        {"dim text on panels", c.dim, c.panel, text},
        {"keys on buttons", key_color(false), c.frame, text},
        {"keys under the mouse", key_color(true), c.frame_hot, text},
        {"keys on chosen buttons", key_color(true), c.frame_on, text},
        {"headings on panels", c.accent, c.panel, text},
        {"headings on windows", c.accent, c.window, text},
        {"good on panels", c.good, c.panel, text},
        {"warnings on panels", c.warning, c.panel, text},
        {"bad on panels", c.bad, c.panel, text},
        {"good on buttons", c.good, c.frame, text},
        {"warnings on buttons", c.warning, c.frame, text},
        {"bad on buttons", c.bad, c.frame, text},
        {"mark of chosen buttons", c.accent, c.frame_on, mark},
        {"sliders", c.grab, c.window, mark},
        {"moved sliders", c.grab_on, c.window, mark},
        {"text on sliders", c.text, c.grab, text},
        {"text on moved sliders", c.text, c.grab_on, text},
        {"scroll bars", c.dim, c.panel, mark},
    };
    *out = all;
    return (int)(sizeof all / sizeof *all);
}

static ImU32 packed(Color c) { return IM_COL32(c.r, c.g, c.b, c.a); }
static ImVec4 as_vector(Color c) { return ImVec4(c.r / 255.0f, c.g / 255.0f, c.b / 255.0f, c.a / 255.0f); }
static ImDrawList *list() { return ImGui::GetWindowDrawList(); }
static float whole(float x) { return std::floor(x + 0.5f); }

static void set_style(float scale)
{
    ImGuiStyle &style = ImGui::GetStyle();
    style = ImGuiStyle();
    style.WindowRounding = style.ChildRounding = style.FrameRounding = style.GrabRounding = style.TabRounding = style.PopupRounding = 0;
    style.WindowBorderSize = style.ChildBorderSize = style.FrameBorderSize = style.TabBorderSize = 0;
    style.PopupBorderSize = 1;
    style.AntiAliasedFill = false;
    style.WindowPadding = ImVec2(whole(10 * scale), whole(8 * scale));
    style.FramePadding = ImVec2(whole(6 * scale), whole(3 * scale));
    style.ItemSpacing = ImVec2(whole(6 * scale), whole(3 * scale));
    style.ItemInnerSpacing = ImVec2(whole(4 * scale), whole(3 * scale));
    style.ScrollbarSize = whole(11 * scale);
    style.GrabMinSize = whole(10 * scale);
    style.WindowMinSize = ImVec2(4, 4);
    const struct {
        int which;
        Color color;
    } colors[] = {{ImGuiCol_Text, gui_colors.text},
                  {ImGuiCol_TextDisabled, gui_colors.dim},
                  {ImGuiCol_WindowBg, gui_colors.panel},
                  {ImGuiCol_ChildBg, {0, 0, 0, 0}},
                  {ImGuiCol_PopupBg, gui_colors.window},
                  {ImGuiCol_Border, gui_colors.line},
                  {ImGuiCol_FrameBg, gui_colors.frame},
                  {ImGuiCol_FrameBgHovered, gui_colors.frame_hot},
                  {ImGuiCol_FrameBgActive, gui_colors.frame_hot},
                  {ImGuiCol_SliderGrab, gui_colors.grab},
                  {ImGuiCol_SliderGrabActive, gui_colors.grab_on},
                  {ImGuiCol_ScrollbarBg, gui_colors.panel},
                  {ImGuiCol_ScrollbarGrab, gui_colors.dim},
                  {ImGuiCol_ScrollbarGrabHovered, gui_colors.text},
                  {ImGuiCol_ScrollbarGrabActive, gui_colors.text},
                  {ImGuiCol_Tab, gui_colors.frame},
                  {ImGuiCol_TabHovered, gui_colors.frame_hot},
                  {ImGuiCol_TabActive, gui_colors.frame_on},
                  {ImGuiCol_TabUnfocused, gui_colors.frame},
                  {ImGuiCol_TabUnfocusedActive, gui_colors.frame_on},
                  {ImGuiCol_TextSelectedBg, gui_colors.frame_on}};
    for (const auto &c : colors)
        style.Colors[c.which] = as_vector(c.color);
}

static void make_fonts(Gui *gui, float scale)
{
    // Latin with its extensions, Greek, Cyrillic, dashes and quotes, arrows, minus, and the signs used by the panel
    static const ImWchar letters[] = {0x20,   0x17f,  0x391,  0x3c9,  0x400,  0x45f,  0x2010, 0x2027, 0x2190, 0x2193, 0x2212,
                                      0x2212, 0x25a0, 0x25a0, 0x25b2, 0x25b2, 0x25cb, 0x25cf, 0x2713, 0x2717, 0};
    static const ImWchar large[] = {0x20, 0xff, 0x2010, 0x2027, 0x2212, 0x2212, 0};
    static const float pixels[GUI_FONTS] = {13, 15, 19, 28};
    ImGuiIO &io = ImGui::GetIO();
    io.Fonts->Clear();
    ImFontConfig config;
    config.OversampleH = config.OversampleV = 1;   // glyphs lie on whole pixels
    config.PixelSnapH = true;
    for (int i = 0; i < GUI_FONTS; i++)
        gui->font[i] = font_add(whole(pixels[i] * scale), i == GUI_HUGE ? large : letters, config);
    io.FontDefault = gui->font[GUI_NORMAL];
    gui->scale = scale;
}

extern "C" Gui *gui_create(char *message, size_t capacity)
{
    Gui *gui = new (std::nothrow) Gui();
    if (!gui) {
        std::snprintf(message, capacity, "out of memory");
        return nullptr;
    }
    ImGuiContext *previous = ImGui::GetCurrentContext();
    imgui_use_heap();
    gui->context = ImGui::CreateContext();
    ImGui::SetCurrentContext(gui->context);
    ImGuiIO &io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.LogFilename = nullptr;
    io.ConfigWindowsMoveFromTitleBarOnly = true;
    const struct {
        int imgui, key;
    } keys[] = {{ImGuiKey_LeftArrow, WINDOW_KEY_LEFT}, {ImGuiKey_RightArrow, WINDOW_KEY_RIGHT}, {ImGuiKey_Home, WINDOW_KEY_HOME},
                {ImGuiKey_End, WINDOW_KEY_END},        {ImGuiKey_Delete, WINDOW_KEY_DELETE},    {ImGuiKey_Backspace, WINDOW_KEY_BACKSPACE},
                {ImGuiKey_Enter, WINDOW_KEY_ENTER},    {ImGuiKey_Escape, WINDOW_KEY_ESCAPE},    {ImGuiKey_A, 'A'}};
    for (const auto &k : keys)
        io.KeyMap[k.imgui] = k.key;
    static_assert(WINDOW_KEYS <= IM_ARRAYSIZE(ImGuiIO::KeysDown), "ImGui holds every key");
    gui->has_backend = ImGui_ImplOpenGL3_Init("#version 330 core");
    ImGui::SetCurrentContext(previous);
    if (!gui->has_backend) {
        std::snprintf(message, capacity, "cannot initialise Dear ImGui's OpenGL back end");
        gui_destroy(gui);
        return nullptr;
    }
    return gui;
}

extern "C" void gui_destroy(Gui *gui)
{
    if (!gui)
        return;
    ImGuiContext *previous = ImGui::GetCurrentContext();
    ImGui::SetCurrentContext(gui->context);
    if (gui->has_backend)
        ImGui_ImplOpenGL3_Shutdown();
    glDeleteFramebuffers(1, &gui->keep_framebuffer);
    glDeleteTextures(1, &gui->keep_texture);
    ImGui::DestroyContext(gui->context);
    ImGui::SetCurrentContext(previous == gui->context ? nullptr : previous);
    delete gui;
}

// A key pressed and released between two frames is pressed for one of them.
static void feed_keys(Gui *gui, ImGuiIO &io, const WindowInput *input)
{
    for (int key = 0; key < WINDOW_KEYS; key++)
        if (gui->released[key])
            io.KeysDown[key] = gui->released[key] = false;
    for (int i = 0; i < input->event_count; i++) {
        const WindowEvent *event = &input->event[i];
        if (event->kind == WINDOW_KEY_DOWN_EVENT) {
            io.KeysDown[event->key] = true;
            gui->released[event->key] = false;
        } else if (event->kind == WINDOW_KEY_UP_EVENT) {
            gui->released[event->key] = true;
        } else if (event->kind == WINDOW_TEXT_EVENT) {
            io.AddInputCharacter(event->character);
        } else if (event->kind == WINDOW_SCROLL_EVENT) {
            io.MouseWheel += event->scroll_y;
        } else if (event->kind == WINDOW_FOCUS_LOST_EVENT) {
            std::memset(io.KeysDown, 0, sizeof io.KeysDown);
            io.ClearInputCharacters();
        }
    }
    io.KeyCtrl = io.KeysDown[WINDOW_KEY_CTRL];
    io.KeyShift = io.KeysDown[WINDOW_KEY_SHIFT];
    io.KeyAlt = io.KeysDown[WINDOW_KEY_ALT];
}

extern "C" void gui_begin(Gui *gui, const WindowInput *input, double scale, bool is_silent)
{
    gui->takes_text = false;
    gui->cut_count = 0;
    gui->previous = ImGui::GetCurrentContext();
    ImGui::SetCurrentContext(gui->context);
    gui->is_silent = is_silent;
    ImGuiIO &io = ImGui::GetIO();
    if (gui->scale <= 0 || std::fabs(scale / gui->scale - 1) > 0.05) {
        ImGui_ImplOpenGL3_DestroyFontsTexture();
        make_fonts(gui, (float)scale);
        set_style((float)scale);
        ImGui_ImplOpenGL3_CreateFontsTexture();
        gui->kept_count = 0;
    }
    for (int i = 0; i < gui->kept_count; i++)
        gui->kept[i].list = nullptr;
    io.DisplaySize = ImVec2((float)input->width, (float)input->height);
    io.DeltaTime = 1.0f / 30;
    if (!is_silent) {
        bool has_mouse = input->mouse_x >= 0 && input->mouse_y >= 0;
        io.MousePos = has_mouse ? ImVec2((float)input->mouse_x, (float)input->mouse_y) : ImVec2(-FLT_MAX, -FLT_MAX);
        for (int i = 0; i < 3; i++)
            io.MouseDown[i] = input->mouse_buttons >> i & 1;
        feed_keys(gui, io, input);
    }
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
}

// ---- cached windows

// Where nothing has to be converted or turned over, a plain copy costs a third: the buffer of a window has the byte order
// BGRA and rows downwards, one off screen RGBA and upwards. (With the sized GL_RGBA8 Mesa does not take the order from the last arguments.)
static bool make_keep(Gui *gui, int width, int height, bool is_window)
{
    if (gui->keep_width == width && gui->keep_height == height && gui->is_turned == is_window)
        return true;
    if (!gui->keep_texture) {
        glGenTextures(1, &gui->keep_texture);
        glGenFramebuffers(1, &gui->keep_framebuffer);
    }
    GLint texture;
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &texture);
    glBindTexture(GL_TEXTURE_2D, gui->keep_texture);
    if (is_window)
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, width, height, 0, GL_BGRA, GL_UNSIGNED_BYTE, nullptr);
    else
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glBindTexture(GL_TEXTURE_2D, (GLuint)texture);
    glBindFramebuffer(GL_FRAMEBUFFER, gui->keep_framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, gui->keep_texture, 0);
    gui->keep_width = width;
    gui->keep_height = height;
    gui->is_turned = is_window;
    for (int i = 0; i < gui->kept_count; i++)
        gui->kept[i].is_drawn = false;
    return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

static void keep_window(Gui *gui, GuiRect at, unsigned flags)
{
    ImGuiWindow *window = ImGui::GetCurrentWindow();
    int i = 0;
    while (i < gui->kept_count && gui->kept[i].id != window->ID)
        i++;
    if (i == KEPT_WINDOWS)
        return;   // drawn like any other, except for its background
    if (i == gui->kept_count)
        gui->kept[gui->kept_count++] = KeptWindow{window->ID, nullptr, at, false, false, 0, 0};
    KeptWindow *kept = &gui->kept[i];
    if (std::memcmp(&kept->at, &at, sizeof at) != 0)
        kept->is_drawn = false;
    kept->list = window->DrawList;
    kept->at = at;
    kept->is_seldom = flags & GUI_SELDOM;
}

static uint64_t hash_of(const ImDrawList *drawn)
{
    uint64_t hash = 1469598103934665603u + (uint64_t)drawn->IdxBuffer.Size;
    const char *byte = reinterpret_cast<const char *>(drawn->VtxBuffer.Data);
    static_assert(sizeof(ImDrawVert) % 4 == 0, "whole words");
    for (size_t i = 0; i < (size_t)drawn->VtxBuffer.Size * sizeof(ImDrawVert); i += 4) {
        uint32_t word;
        std::memcpy(&word, byte + i, 4);
        hash = (hash ^ word) * 1099511628211u;
    }
    return hash;
}

static void draw_lists(const ImDrawData *all, ImDrawList **lists, int count)
{
    ImDrawData part = *all;
    part.CmdLists = lists;
    part.CmdListsCount = count;
    ImGui_ImplOpenGL3_RenderDrawData(&part);
}

static void swap_clips(ImDrawList *drawn)
{
    for (ImDrawCmd &command : drawn->CmdBuffer)
        std::swap(command.ClipRect.y, command.ClipRect.w);
}

// Draws upside down: the first row is the top one.
static void draw_upside_down(const ImDrawData *all, ImDrawList *drawn)
{
    ImDrawData turned = *all;
    turned.DisplayPos.y = all->DisplaySize.y;
    turned.DisplaySize.y = -all->DisplaySize.y;
    turned.FramebufferScale.y = -1;
    swap_clips(drawn);
    draw_lists(&turned, &drawn, 1);
    swap_clips(drawn);
}

// Brings the kept picture of a window up to date.
static void refresh(Gui *gui, KeptWindow *kept, const ImDrawData *data)
{
    kept->age++;
    if (kept->is_drawn && kept->is_seldom && kept->age < SELDOM_FRAMES)
        return;
    uint64_t hash = hash_of(kept->list);
    if (kept->is_drawn && hash == kept->hash)
        return;
    glBindFramebuffer(GL_FRAMEBUFFER, gui->keep_framebuffer);
    glEnable(GL_SCISSOR_TEST);
    int from = gui->is_turned ? (int)kept->at.y : gui->keep_height - (int)(kept->at.y + kept->at.height);
    glScissor((int)kept->at.x, from, (int)kept->at.width, (int)kept->at.height);
    ImVec4 ground = as_vector(gui_colors.panel);
    glClearColor(ground.x, ground.y, ground.z, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    if (gui->is_turned)
        draw_upside_down(data, kept->list);
    else
        draw_lists(data, &kept->list, 1);
    kept->is_drawn = true;
    kept->hash = hash;
    kept->age = 0;
}

static void copy_kept(const Gui *gui, const KeptWindow *kept)
{
    int left = (int)kept->at.x, right = left + (int)kept->at.width, top = (int)kept->at.y, bottom = top + (int)kept->at.height;
    int to_top = gui->keep_height - top, to_bottom = gui->keep_height - bottom;   // rows go upwards in OpenGL
    glBlitFramebuffer(left, gui->is_turned ? top : to_top, right, gui->is_turned ? bottom : to_bottom, left, to_top, right, to_bottom, GL_COLOR_BUFFER_BIT,
                      GL_NEAREST);
}

static void draw_frame(Gui *gui, unsigned framebuffer)
{
    const ImDrawData *data = ImGui::GetDrawData();
    bool can_keep = make_keep(gui, (int)data->DisplaySize.x, (int)data->DisplaySize.y, framebuffer == 0);
    for (int i = 0; can_keep && i < gui->kept_count; i++)
        if (gui->kept[i].list)
            refresh(gui, &gui->kept[i], data);
    glDisable(GL_SCISSOR_TEST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, gui->keep_framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
    for (int i = 0; can_keep && i < gui->kept_count; i++)
        if (gui->kept[i].list)
            copy_kept(gui, &gui->kept[i]);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    // the other windows on top, drawn directly
    ImVector<ImDrawList *> rest;
    for (int i = 0; i < data->CmdListsCount; i++) {
        bool is_kept = false;
        for (int j = 0; can_keep && j < gui->kept_count; j++)
            is_kept = is_kept || gui->kept[j].list == data->CmdLists[i];
        if (!is_kept)
            rest.push_back(data->CmdLists[i]);
    }
    draw_lists(data, rest.Data, rest.Size);
}

extern "C" void gui_end(Gui *gui, unsigned framebuffer)
{
    if (gui->is_silent) {
        ImGui::EndFrame();
    } else {
        ImGui::Render();
        draw_frame(gui, framebuffer);
        glDisable(GL_BLEND);
        glDisable(GL_SCISSOR_TEST);
    }
    ImGui::SetCurrentContext(gui->previous);
}

extern "C" float gui_scale(const Gui *gui) { return gui->scale; }

extern "C" int gui_cut_texts(const Gui *gui, const char **first)
{
    if (first)
        *first = gui->cut_count > 0 ? gui->first_cut : "";
    return gui->cut_count;
}

static void note_cut(Gui *gui, const char *text)
{
    if (gui->cut_count++ == 0)
        std::snprintf(gui->first_cut, sizeof gui->first_cut, "%s", text);
}

extern "C" bool gui_takes_text(const Gui *gui) { return gui->takes_text; }

// ---- windows and flow

extern "C" void gui_window_begin(Gui *gui, const char *id, GuiRect at, unsigned flags)
{
    ImGuiWindowFlags f = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                         ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav;
    if (!(flags & GUI_ON_TOP))
        f |= ImGuiWindowFlags_NoBringToFrontOnFocus;
    if (flags & (GUI_NO_BACKGROUND | GUI_KEPT))
        f |= ImGuiWindowFlags_NoBackground;
    if (flags & GUI_NO_INPUT)
        f |= ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoScrollbar;
    ImGui::SetNextWindowPos(ImVec2(at.x, at.y));
    ImGui::SetNextWindowSize(ImVec2(at.width, at.height));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, flags & GUI_FRAMED ? 1.0f : 0.0f);
    if (flags & GUI_VEIL)
        ImGui::SetNextWindowBgAlpha(0.7f);
    ImGui::Begin(id, nullptr, f);
    ImGui::PopStyleVar();
    if (flags & GUI_KEPT)
        keep_window(gui, at, flags);
    if (flags & GUI_ON_TOP)
        ImGui::BringWindowToDisplayFront(ImGui::GetCurrentWindow());
    gui->scrolls_to_end = flags & GUI_SCROLL_TO_END;
}

extern "C" float gui_window_end(Gui *gui)
{
    // after the contents, so that "here" is their end; not if the user has scrolled up
    if (gui->scrolls_to_end && ImGui::GetScrollY() >= ImGui::GetScrollMaxY())
        ImGui::SetScrollHereY(1);
    const ImGuiWindow *window = ImGui::GetCurrentWindow();
    float bottom = window->DC.CursorMaxPos.y + window->Scroll.y + ImGui::GetStyle().WindowPadding.y;
    float over = bottom - (window->Pos.y + window->Size.y);
    ImGui::End();
    return over;
}

extern "C" GuiTexture gui_texture_create(int width, int height, const uint8_t *rgb)
{
    GLint before, alignment;
    GLuint texture;
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &before);
    glGetIntegerv(GL_UNPACK_ALIGNMENT, &alignment);
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, width, height, 0, GL_RGB, GL_UNSIGNED_BYTE, rgb);
    glGenerateMipmap(GL_TEXTURE_2D);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glPixelStorei(GL_UNPACK_ALIGNMENT, alignment);
    glBindTexture(GL_TEXTURE_2D, (GLuint)before);
    return texture;
}

extern "C" void gui_texture_destroy(GuiTexture texture) { glDeleteTextures(1, &texture); }

extern "C" GuiRect gui_place(Gui *, float width, float height)
{
    ImVec2 at = ImGui::GetCursorScreenPos();
    if (width <= 0)
        width = std::fmax(1, ImGui::GetContentRegionAvail().x);
    ImGui::Dummy(ImVec2(width, height));
    return GuiRect{at.x, at.y, width, height};
}

extern "C" void gui_scroll_here(Gui *) { ImGui::SetScrollHereY(0.5f); }

extern "C" void gui_beside(Gui *, float gap) { ImGui::SameLine(0, gap); }
extern "C" void gui_space(Gui *, float height) { ImGui::Dummy(ImVec2(0, height)); }
extern "C" float gui_width(Gui *) { return ImGui::GetContentRegionAvail().x; }
extern "C" float gui_line_height(const Gui *gui, GuiFont font) { return gui->font[font]->FontSize; }

extern "C" void gui_text(Gui *gui, GuiFont font, Color color, const char *text)
{
    ImGui::PushFont(gui->font[font]);
    ImGui::PushStyleColor(ImGuiCol_Text, packed(color));
    float room = ImGui::GetContentRegionAvail().x + ImGui::GetStyle().WindowPadding.x;
    if (ImGui::GetCurrentWindow()->DC.TextWrapPos < 0 && ImGui::CalcTextSize(tr(text)).x > room)
        note_cut(gui, text);
    ImGui::TextUnformatted(tr(text));
    ImGui::PopStyleColor();
    ImGui::PopFont();
}

extern "C" void gui_heading(Gui *gui, const char *text)
{
    gui_space(gui, floorf(3 * gui_scale(gui)));
    gui_text(gui, GUI_SMALL, gui_colors.dim, text);
}

extern "C" void gui_text_wrapped(Gui *gui, GuiFont font, Color color, const char *text)
{
    ImGui::PushTextWrapPos(0);
    gui_text(gui, font, color, text);
    ImGui::PopTextWrapPos();
}

extern "C" void gui_row(Gui *gui, GuiFont size, const char *label, Color color, const char *value)
{
    float width, height, label_width, label_height;
    gui_text_extent(gui, size, value, &width, &height);
    gui_text_extent(gui, size, label, &label_width, &label_height);
    GuiRect at = gui_place(gui, 0, height);
    float room = at.width - width - 4 * gui->scale;
    if (label_width > at.width || width > at.width)
        note_cut(gui, label_width > at.width ? label : value);
    gui_draw_text(gui, at.x, at.y, size, gui_colors.dim, label);
    // the value goes below a long label
    if (label_width > room)
        at = gui_place(gui, 0, height);
    gui_draw_text(gui, at.x + at.width - width, at.y, size, color, value);
}

// ---- widgets

extern "C" GuiPress gui_button(Gui *gui, const char *id, const char *label, const char *key, float width, bool is_on)
{
    float height = whole(gui->font[GUI_NORMAL]->FontSize + 8 * gui->scale), pad = whole(6 * gui->scale);
    ImVec2 at = ImGui::GetCursorScreenPos();
    const bool is_row = width <= 0;
    if (is_row)
        width = std::fmax(1, ImGui::GetContentRegionAvail().x);
    char text[400];
    std::snprintf(text, sizeof text, is_on ? "\u2713 %s" : "%s", tr(label));
    // long labels on narrow buttons: small letters, then truncated at the edge; a button as wide as its window gets more lines instead
    GuiFont font = GUI_NORMAL;
    float text_width, text_height, key_width = 0, key_height = 0;
    gui_text_extent(gui, font, text, &text_width, &text_height);
    if (text_width > width - 2 * pad) {
        font = GUI_SMALL;
        gui_text_extent(gui, font, text, &text_width, &text_height);
    }
    if (key)
        gui_text_extent(gui, GUI_SMALL, key, &key_width, &key_height);
    bool is_wrapped = is_row && text_width > width - 2 * pad, has_key = key && text_width + key_width + 3 * pad <= width,
         key_is_below = is_row && key && *key && !has_key;
    if (is_wrapped)
        text_height = gui_wrapped_height(gui, font, text, width - 2 * pad);
    else if (text_width > width)
        note_cut(gui, label);
    if (is_wrapped || key_is_below)
        height = text_height + 2 * pad + (key_is_below ? key_height : 0);

    GuiPress press;
    press.pressed = ImGui::InvisibleButton(id, ImVec2(width, height));
    press.held = ImGui::IsItemActive() && ImGui::IsMouseDown(0);
    bool is_hot = ImGui::IsItemHovered(), is_bright = is_on || press.held || is_hot;
    GuiRect rect = {at.x, at.y, width, height};
    gui_draw_fill(gui, rect, is_on || press.held ? gui_colors.frame_on : is_hot ? gui_colors.frame_hot : gui_colors.frame);
    if (is_on || press.held)
        gui_draw_fill(gui, {at.x, at.y, whole(3 * gui->scale), height}, gui_colors.accent);
    float x = has_key || key_is_below || is_wrapped ? at.x + pad : at.x + std::fmax(2, (width - text_width) / 2);
    float y = at.y + (height - text_height - (key_is_below ? key_height : 0)) / 2;
    list()->PushClipRect(at, ImVec2(at.x + width, at.y + height), true);
    if (is_wrapped)
        gui_draw_wrapped(gui, x, y, font, gui_colors.text, text, width - 2 * pad);
    else
        gui_draw_text(gui, x, y, font, gui_colors.text, text);
    if (has_key || key_is_below)
        gui_draw_text(gui, at.x + width - pad - key_width, has_key ? at.y + (height - key_height) / 2 : y + text_height, GUI_SMALL, key_color(is_bright), key);
    list()->PopClipRect();
    return press;
}

extern "C" bool gui_slider(Gui *gui, const char *id, float *value, float least, float most, const char *format, float width)
{
    ImGui::PushID(id);
    ImGui::SetNextItemWidth(width > 0 ? width : ImGui::GetContentRegionAvail().x);
    // a dark groove: both the grab in it and the text on the grab are then seen
    for (int which : {ImGuiCol_FrameBg, ImGuiCol_FrameBgHovered, ImGuiCol_FrameBgActive})
        ImGui::PushStyleColor(which, packed(gui_colors.window));
    // no text input by Ctrl+click: the keys control the trainer
    bool is_moved = ImGui::SliderFloat("##value", value, least, most, tr(format), ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoInput);
    ImGui::PopStyleColor(3);
    ImGui::PopID();
    (void)gui;
    return is_moved;
}

extern "C" bool gui_card(Gui *gui, const char *id, GuiTexture texture, const char *title, const char *line, const char *right, bool is_on)
{
    float pad = whole(6 * gui->scale), height = whole(64 * gui->scale), picture = whole(1.6f * (height - 2 * pad)), right_width, right_height, title_width,
          title_height;
    ImVec2 at = ImGui::GetCursorScreenPos();
    float width = std::fmax(1, ImGui::GetContentRegionAvail().x);
    bool is_pressed = ImGui::InvisibleButton(id, ImVec2(width, height)), is_hot = ImGui::IsItemHovered();
    if (!ImGui::IsItemVisible())
        return is_pressed;
    gui_draw_fill(gui, {at.x, at.y, width, height}, is_on ? gui_colors.frame_on : is_hot ? gui_colors.frame_hot : gui_colors.frame);
    if (is_on)
        gui_draw_fill(gui, {at.x, at.y, whole(3 * gui->scale), height}, gui_colors.accent);
    GuiRect place = {at.x + pad, at.y + pad, picture, height - 2 * pad};
    gui_draw_fill(gui, place, gui_colors.window);
    if (texture)
        list()->AddImage((ImTextureID)(uintptr_t)texture, ImVec2(place.x, place.y), ImVec2(place.x + place.width, place.y + place.height));
    gui_text_extent(gui, GUI_SMALL, right, &right_width, &right_height);
    gui_text_extent(gui, GUI_NORMAL, title, &title_width, &title_height);
    float x = place.x + picture + 2 * pad, end = at.x + width - pad;
    // the right part goes below if there is no room for both
    bool is_beside = x + title_width + 2 * pad + right_width <= end;
    if (x + title_width > end)
        note_cut(gui, title);
    list()->PushClipRect(at, ImVec2(end, at.y + height), true);
    gui_draw_text(gui, x, at.y + pad, GUI_NORMAL, gui_colors.text, title);
    gui_draw_text(gui, x, at.y + pad + title_height + pad / 2, GUI_SMALL, key_color(is_on || is_hot), line);
    gui_draw_text(gui, is_beside ? end - right_width : x, is_beside ? at.y + pad : at.y + height - pad / 2 - right_height, GUI_SMALL,
                  key_color(is_on || is_hot), right);
    list()->PopClipRect();
    return is_pressed;
}

extern "C" void gui_progress(Gui *gui, double part, const char *text)
{
    float height = whole(gui->font[GUI_NORMAL]->FontSize + 6 * gui->scale), text_width, text_height;
    GuiRect at = gui_place(gui, 0, height), full = at;
    part = part > 0 ? std::fmin(part, 1) : 0;   // NaN counts as none
    gui_draw_fill(gui, at, gui_colors.frame);
    full.width = whole((float)(at.width * part));
    gui_draw_fill(gui, full, gui_colors.frame_on);
    GuiFont font = GUI_NORMAL;
    gui_text_extent(gui, font, text, &text_width, &text_height);
    if (text_width > at.width) {
        font = GUI_SMALL;
        gui_text_extent(gui, font, text, &text_width, &text_height);
    }
    gui_draw_text(gui, at.x + std::fmax(0.0f, at.width - text_width) / 2, at.y + (height - text_height) / 2, font, gui_colors.text, text);
}

extern "C" void gui_tooltip(Gui *gui, const char *title, const char *text, const char *last)
{
    if (!ImGui::IsItemHovered() || ImGui::GetCurrentContext()->HoveredIdTimer < 0.5f)
        return;
    // beside a column and below a bar, so that it covers none of the buttons near the mouse
    ImVec2 window = ImGui::GetWindowPos(), size = ImGui::GetWindowSize(), item = ImGui::GetItemRectMin(), all = ImGui::GetIO().DisplaySize;
    bool is_column = size.y > size.x / 2, is_right = window.x + size.x / 2 > all.x / 2;
    float gap = whole(4 * gui->scale), x = is_right ? window.x - gap : window.x + size.x + gap;
    if (is_column)
        ImGui::SetNextWindowPos(ImVec2(x, item.y), ImGuiCond_Always, ImVec2(is_right ? 1.0f : 0.0f, item.y > all.y / 2 ? 0.5f : 0.0f));
    else
        ImGui::SetNextWindowPos(ImVec2(is_right ? window.x + size.x : item.x, window.y + size.y + gap), ImGuiCond_Always, ImVec2(is_right ? 1.0f : 0.0f, 0));
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(whole(320 * gui->scale));
    if (title)
        gui_text(gui, GUI_NORMAL, gui_colors.text, title);
    if (text)
        gui_text(gui, GUI_SMALL, gui_colors.dim, text);
    if (last)
        gui_text(gui, GUI_SMALL, gui_colors.accent, last);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

extern "C" bool gui_tabs_begin(Gui *gui, const char *id)
{
    ImGui::PushFont(gui->font[GUI_SMALL]);   // five tabs must fit into a narrow column
    bool is_open = ImGui::BeginTabBar(id, ImGuiTabBarFlags_NoTooltip | ImGuiTabBarFlags_FittingPolicyResizeDown);
    if (!is_open)
        ImGui::PopFont();
    return is_open;
}

extern "C" bool gui_tab_begin(Gui *gui, const char *name)
{
    char label[120];
    std::snprintf(label, sizeof label, "%s###%s", tr(name), name);
    bool is_open = ImGui::BeginTabItem(label);
    if (is_open)
        ImGui::PushFont(gui->font[GUI_NORMAL]);
    return is_open;
}

extern "C" void gui_tab_end(Gui *)
{
    ImGui::PopFont();
    ImGui::EndTabItem();
}

extern "C" void gui_tabs_end(Gui *)
{
    ImGui::EndTabBar();
    ImGui::PopFont();
}

extern "C" bool gui_text_field(Gui *gui, const char *id, char *text, size_t capacity, bool take_focus)
{
    if (take_focus)
        ImGui::SetKeyboardFocusHere();
    ImGui::PushID(id);
    ImGui::SetNextItemWidth(-1);
    bool is_entered = ImGui::InputText("##text", text, capacity, ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll);
    gui->takes_text = gui->takes_text || ImGui::IsItemActive();
    ImGui::PopID();
    return is_entered;
}

// ---- drawing

extern "C" void gui_draw_fill(Gui *, GuiRect at, Color color)
{
    list()->AddRectFilled(ImVec2(at.x, at.y), ImVec2(at.x + at.width, at.y + at.height), packed(color));
}

extern "C" void gui_draw_line(Gui *, float x0, float y0, float x1, float y1, Color color, float thickness)
{
    list()->AddLine(ImVec2(x0, y0), ImVec2(x1, y1), packed(color), thickness);
}

extern "C" void gui_draw_text(Gui *gui, float x, float y, GuiFont font, Color color, const char *text)
{
    list()->AddText(gui->font[font], gui->font[font]->FontSize, ImVec2(whole(x), whole(y)), packed(color), tr(text));   // whole pixels keep letters sharp
}

extern "C" void gui_draw_wrapped(Gui *gui, float x, float y, GuiFont font, Color color, const char *text, float width)
{
    list()->AddText(gui->font[font], gui->font[font]->FontSize, ImVec2(whole(x), whole(y)), packed(color), tr(text), nullptr, width);
}

extern "C" void gui_text_extent(Gui *gui, GuiFont font, const char *text, float *width, float *height)
{
    ImVec2 extent = gui->font[font]->CalcTextSizeA(gui->font[font]->FontSize, 1e9f, 0, tr(text));
    *width = extent.x;
    *height = extent.y;
}

extern "C" float gui_wrapped_height(Gui *gui, GuiFont font, const char *text, float width)
{
    return gui->font[font]->CalcTextSizeA(gui->font[font]->FontSize, 1e9f, width, tr(text)).y;
}
