// The arteries from the groin to the head: left iliac artery, aorta with the other iliac artery, arch, and the neck's arteries as far as the skull.
//
// An idealised course drawn by hand, with the dimensions of the vessel in stEVE_bench's DualDeviceNav (15 branches, measured with `info` and `export`
// on the model that scenes/arch/prepare makes of it), so that the two-device task runs without that file:
//                                   there: length, mean radius [mm]      here
//   left iliac artery to the other            70, 6.1                        86, 4.9
//   aorta to the end of this model           436, 12.7 (5.0 to 16.5)        432, 11.9 (7.0 to 15.0)
//   left subclavian to its vertebral          37, 4.8                        47, 5.3
//   left vertebral and basilar               258, 3.1                       248, 2.8
//   brachiocephalic to its fork               46, 7.7                        38, 6.5
//   left, right carotid into the skull       292, 3.1; 245, 3.3             242, 3.2; 222, 3.1
// The top of the arch has a bend radius of 31 mm. Omitted: vessels that turn back within the skull, and the right vertebral artery's junction with the
// basilar artery, because a tree has no loops. x to the patient's left, y to the front, z to the head.
#include "recon/phantom/phantom_parts.h"

bool aorta_grow(Shape *shape)
{
    static const double trunk[][4] = {{45, 0, -75, 4.3},         {28, 6, -45, 4.6},          {11, 5, -15, 5.2},   {2, 1, 12, 8.5},
                                      {0, -3, 40, 10.4},         {2, -8, 90, 10.3},          {6, -14, 140, 11},   {12, -20, 190, 12.5},
                                      {18, -25, 240, 14},        {21, -27, 285, 14.8}, // then around the arch, in the vertical plane to the front right
                                      {18.9, -23.6, 300.5, 15},  {12.8, -14.1, 311.8, 14.8}, {4.5, -1, 316, 14},  {-3.8, 12.1, 311.8, 13},
                                      {-9.9, 21.6, 300.5, 12.6}, {-12, 25, 285, 12.6},       {-9, 29, 262, 12.8}, {-4, 30, 240, 13}};
    static const double iliac[][4] = {{4, 2, 6, 5}, {-8, 4, -14, 4.8}, {-24, 6, -42, 4.5}, {-40, 0, -68, 4.4}};
    static const double subclavian[][4] = {{13, -14, 312, 4.9}, {15, -15, 332, 4.8}, {21, -16, 348, 4.6}, {30, -14, 358, 4.3},
                                           {45, -12, 364, 3.9}, {62, -8, 362, 3.4},  {85, -4, 352, 3},    {112, 0, 340, 2.6}};
    static const double vertebral[][4] = {{30, -14, 358, 2.8}, {29, -17, 372, 2.7}, {26, -22, 392, 2.7}, {25, -24, 420, 2.9}, {25, -23, 450, 3},
                                          {26, -22, 478, 2.9}, {32, -24, 492, 2.8}, {36, -30, 502, 2.7}, {30, -36, 509, 2.6}, {20, -33, 514, 2.6},
                                          {10, -24, 524, 2.6}, {3, -16, 538, 2.7},  {0, -12, 556, 2.6},  {0, -10, 578, 2.3}};
    static const double left_carotid[][4] = {{4, 0, 314, 4.6},  {7, 3, 336, 4.2},  {13, 6, 360, 3.9},  {18, 8, 395, 3.5},  {20, 9, 430, 3.3}, {21, 9, 452, 3.9},
                                             {22, 6, 470, 3.2}, {20, 2, 490, 2.6}, {18, -2, 515, 2.4}, {16, -4, 538, 2.3}, {13, 1, 553, 2.2}, {10, 7, 565, 2}};
    static const double left_face[][4] = {{21, 9, 452, 2.4}, {26, 12, 466, 2.2}, {30, 14, 486, 2}, {32, 14, 510, 1.8}};
    static const double brachiocephalic[][4] = {{-3, 10, 311, 6.4}, {-8, 14, 330, 6.1}, {-16, 14, 346, 5.6}, {-26, 10, 356, 4.5},
                                                {-36, 4, 362, 4},   {-53, 0, 364, 3.5}, {-76, 2, 354, 3},    {-104, 4, 340, 2.4}};
    static const double right_carotid[][4] = {{-15, 14, 345, 4.2}, {-18, 13, 362, 3.9}, {-20, 11, 386, 3.5}, {-21, 10, 420, 3.3},
                                              {-21, 9, 452, 3.9},  {-21, 6, 470, 3.1},  {-19, 2, 490, 2.6},  {-17, -2, 515, 2.4},
                                              {-15, -4, 538, 2.2}, {-12, 2, 553, 2.1},  {-8, 8, 566, 1.9}};
    static const double right_face[][4] = {{-21, 9, 452, 2.4}, {-26, 12, 466, 2.2}, {-30, 14, 486, 2}, {-32, 14, 510, 1.8}};
    static const double right_vertebral[][4] = {{-36, 4, 362, 2.5},   {-34, -4, 374, 2.4},  {-28, -16, 392, 2.4}, {-25, -22, 420, 2.6}, {-25, -23, 450, 2.6},
                                                {-26, -22, 478, 2.5}, {-32, -24, 492, 2.4}, {-36, -30, 502, 2.3}, {-30, -36, 509, 2.2}, {-20, -33, 514, 2.1}};
#define PART(knots, open, parent) shape_add(shape, knots, (int)(sizeof knots / sizeof knots[0]), open, false, parent, NODE_VESSEL, NULL)
    return PART(trunk, true, -1) && PART(iliac, false, 0) && PART(subclavian, false, 0) && PART(vertebral, false, 2) && PART(left_carotid, false, 0) &&
           PART(left_face, false, 4) && PART(brachiocephalic, false, 0) && PART(right_carotid, false, 6) && PART(right_face, false, 7) &&
           PART(right_vertebral, false, 6);
#undef PART
}
