// Makes Dear ImGui end the program if out of memory, instead of continuing with a null pointer. C++ only; include before a context is created.
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
