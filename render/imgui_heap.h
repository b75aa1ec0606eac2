// Makes Dear ImGui end the program when memory runs out, instead of continuing with a null pointer. C++ only; to be included before a context is
// made.
#ifndef SELDINGER_RENDER_IMGUI_HEAP_H
#define SELDINGER_RENDER_IMGUI_HEAP_H

#include "base/base.h"

#include <cstdlib>
#include <imgui.h>

inline void imgui_use_heap()
{
    ImGui::SetAllocatorFunctions([](size_t bytes, void *) { return HEAP_GROWN(nullptr, bytes, 1); }, [](void *memory, void *) { std::free(memory); });
}

#endif
