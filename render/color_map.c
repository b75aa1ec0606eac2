#include "render/color_map.h"

static Color from_table(const uint8_t (*table)[3], int count, double x)
{
    if (!(x > 0))   // also NaN
        x = 0;
    if (x > 1)
        x = 1;
    double place = x * (count - 1);
    int low = (int)place;
    if (low > count - 2)
        low = count - 2;
    double s = place - low;
    Color c = {.a = 255};
    c.r = (uint8_t)(table[low][0] + s * (table[low + 1][0] - table[low][0]) + 0.5);
    c.g = (uint8_t)(table[low][1] + s * (table[low + 1][1] - table[low][1]) + 0.5);
    c.b = (uint8_t)(table[low][2] + s * (table[low + 1][2] - table[low][2]) + 0.5);
    return c;
}

Color color_sequential(double x)
{
    static const uint8_t table[13][3] = {{16, 9, 45},   {43, 11, 87},  {74, 12, 107},  {103, 22, 110}, {132, 32, 107}, {160, 42, 99}, {188, 55, 84},
                                         {211, 71, 67}, {231, 94, 46}, {245, 123, 23}, {251, 155, 6},  {251, 190, 35}, {244, 225, 86}};
    return from_table(table, 13, x);
}

Color color_diverging(double x)
{
    static const uint8_t table[9][3] = {{5, 48, 97},     {33, 102, 172}, {67, 147, 195}, {146, 197, 222}, {228, 227, 224},
                                        {244, 165, 130}, {214, 96, 77},  {178, 24, 43},  {103, 0, 31}};
    return from_table(table, 9, 0.5 + 0.5 * x);
}

Color color_qualitative(int index)
{
    static const uint8_t table[14][3] = {{230, 159, 0},   {86, 180, 233},  {0, 158, 115},  {240, 228, 66},  {213, 94, 0},   {204, 121, 167}, {0, 114, 178},
                                         {255, 204, 102}, {166, 219, 255}, {90, 220, 180}, {250, 245, 160}, {255, 150, 80}, {240, 180, 215}, {90, 170, 230}};
    const uint8_t *c = table[(index < 0 ? 0 : index) % 14];
    return color_rgb(c[0], c[1], c[2]);
}
