// The motions of all hands become one command per tool: no count of a hand is lost or used twice, locked tools move as one, released tools do not move, and
// each hand gets the force of the tool that it moves.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/hand_set.h"
#include "tests/geom/near.h"

#include <math.h>
#include <string.h>

enum { PORTS = 3 };

static HandSet set;
static HandPort port[PORTS];

static void take_hands(int tool_count)
{
    memset(port, 0, sizeof port);
    hand_set_init(&set, tool_count);
    for (int i = 0; i < PORTS; i++)
        assert_true(hand_set_add(&set, &port[i]));
}

static void choose(int tool)
{
    HandGrip grip = set.grip;
    hand_grip_choose(&grip, set.tool_count, tool);
    hand_set_grip(&set, &grip);
}

static void lock(void)
{
    HandGrip grip = set.grip;
    hand_grip_lock(&grip, set.tool_count);
    hand_set_grip(&set, &grip);
}

static void let_go(void)
{
    HandGrip grip = set.grip;
    hand_grip_release(&grip);
    hand_set_grip(&set, &grip);
}

static void assert_command(const ToolCommands *commands, int tool, double push_mm_s, double twist_deg_s)
{
    assert_near(commands->tool[tool].push_mm_s, push_mm_s, 1e-9);
    assert_near(commands->tool[tool].twist_deg_s, twist_deg_s, 1e-9);
}

static void ways_are_fed_whole_and_no_faster_than_the_limit(void **state)
{
    (void)state;
    take_hands(1);
    double fed_mm = 0, fed_deg = 0;
    port[1].advanced_mm = 7.3;     // one report of an encoder: 7.3 mm at once
    port[2].advanced_mm = -0.05;   // and another hand that pulls
    port[2].turned_deg = 33;
    for (int i = 0; i < 100; i++) {
        if (i == 50)
            port[1].advanced_mm = 7.3 + 1.25;
        Command command = hand_set_command(&set, 1).tool[0];
        assert_true(fabs(command.push_mm_s) <= set.fastest_mm_s * (1 + 1e-12));
        assert_true(fabs(command.twist_deg_s) <= set.fastest_deg_s * (1 + 1e-12));
        fed_mm += command.push_mm_s / 1000;
        fed_deg += command.twist_deg_s / 1000;
    }
    assert_true(fabs(fed_mm - (7.3 + 1.25 - 0.05)) < 1e-12);
    assert_true(fabs(fed_deg - 33) < 1e-12);
}

static void rates_add_and_stop_holds_all_tools(void **state)
{
    (void)state;
    for (int tools = 1; tools <= 2; tools++) {
        take_hands(tools);
        port[0].push_mm_s = 10;
        port[1].push_mm_s = -4;
        port[1].twist_deg_s = 90;
        port[2].drives = DRIVES_TOOL + 1;      // with a single tool, it is that tool
        port[2].push_mm_s = 2;
        ToolCommands commands = hand_set_command(&set, 1);
        assert_command(&commands, 0, tools == 1 ? 8 : 6, 90);
        assert_command(&commands, 1, tools == 1 ? 0 : 2, 0);
        port[2].buttons = HAND_STOP;
        port[2].advanced_mm = 3;
        commands = hand_set_command(&set, 1);
        assert_true(commands.tool[0].push_mm_s == 0 && commands.tool[0].twist_deg_s == 0 && commands.tool[1].push_mm_s == 0);
        port[2].buttons = 0;
        commands = hand_set_command(&set, 1);  // motion during a stop is not applied afterwards
        assert_command(&commands, 0, tools == 1 ? 8 : 6, 90);
        assert_command(&commands, 1, tools == 1 ? 0 : 2, 0);
        port[0].push_mm_s = NAN;               // a failing hand does no harm
        port[1].push_mm_s = HUGE_VAL;
        port[2].advanced_mm = NAN;
        commands = hand_set_command(&set, 1);
        assert_true(fabs(commands.tool[0].push_mm_s) <= set.fastest_mm_s && fabs(commands.tool[1].push_mm_s) <= set.fastest_mm_s);
    }
}

// Which tool each kind of hand moves, for each selected tool.
static void each_hand_moves_its_tool(void **state)
{
    (void)state;
    static const struct {
        int tools, chosen, moved[5];   // by DRIVES_CHOSEN, _PARTNER, _OUTER, _INNER, _TOOL + 2
    } cases[] = {{1, 0, {0, 0, 0, 0, 0}}, {2, 0, {0, 1, 0, 1, 1}}, {2, 1, {1, 0, 0, 1, 1}}, {3, 0, {0, 1, 0, 1, 2}}, {3, 1, {1, 2, 1, 2, 2}},
                 {3, 2, {2, 1, 1, 2, 2}}, {4, 0, {0, 1, 0, 1, 2}}, {4, 2, {2, 3, 2, 3, 2}}, {4, 3, {3, 2, 2, 3, 2}}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++)
        for (int drives = 0; drives < 5; drives++) {
            take_hands(cases[c].tools);
            choose(cases[c].chosen);
            port[1].drives = drives == 4 ? DRIVES_TOOL + 2 : drives;
            port[1].push_mm_s = 5;
            port[1].turned_deg = 0.2;
            ToolCommands commands = hand_set_command(&set, 1);
            StepReport report = {.push = {1, 2, 3, 4}, .torque = {10, 20, 30, 40}};
            hand_set_answer(&set, &report, 7);
            for (int k = 0; k < TOOLS_MOST; k++)
                assert_command(&commands, k, k == cases[c].moved[drives] ? 5 : 0, k == cases[c].moved[drives] ? 200 : 0);
            assert_true(port[1].force_n == cases[c].moved[drives] + 1 && port[1].torque_n_mm == 10 * (cases[c].moved[drives] + 1) && port[1].step == 7);
            assert_true(port[0].force_n == cases[c].chosen + 1);
        }
    choose(1);
    choose(4);                                 // this tool does not exist: nothing changes
    choose(-1);
    assert_int_equal(set.grip.chosen, 1);
}

static void what_is_still_owed_does_not_follow_to_another_tool(void **state)
{
    (void)state;
    take_hands(2);
    port[0].advanced_mm = 5;                   // needs at least 25 steps
    ToolCommands commands = hand_set_command(&set, 1);
    assert_command(&commands, 0, 200, 0);
    choose(1);
    commands = hand_set_command(&set, 1);
    assert_command(&commands, 0, 0, 0);
    assert_command(&commands, 1, 0, 0);
    port[0].advanced_mm = 5.1;
    commands = hand_set_command(&set, 1);
    assert_command(&commands, 1, 100, 0);
}

static void locked_tools_move_as_one_and_are_felt_together(void **state)
{
    (void)state;
    take_hands(3);
    choose(1);
    lock();                                    // the second and the third
    assert_true(hand_grip_pair_is_locked(&set.grip, 3));
    port[0].push_mm_s = 10;
    port[1].drives = DRIVES_TOOL + 2;
    port[1].push_mm_s = -4;
    port[1].twist_deg_s = 30;
    port[2].drives = DRIVES_TOOL;
    port[2].push_mm_s = 1;
    ToolCommands commands = hand_set_command(&set, 1);
    assert_command(&commands, 0, 1, 0);
    assert_command(&commands, 1, 6, 30);
    assert_command(&commands, 2, 6, 30);
    StepReport report = {.push = {1, 2, 4}, .torque = {10, 20, 40}};
    hand_set_answer(&set, &report, 1);
    assert_true(port[0].force_n == 6 && port[1].force_n == 6 && port[2].force_n == 1 && port[0].torque_n_mm == 60 && port[2].torque_n_mm == 10);

    // the motions of both hands are applied completely, together no faster than one hand
    port[0].push_mm_s = port[1].push_mm_s = port[1].twist_deg_s = port[2].push_mm_s = 0;
    port[0].advanced_mm = 3;
    port[1].advanced_mm = 2;
    double fed[3] = {0};
    for (int i = 0; i < 40; i++) {
        commands = hand_set_command(&set, 1);
        for (int k = 0; k < 3; k++)
            fed[k] += commands.tool[k].push_mm_s / 1000;
        assert_true(commands.tool[1].push_mm_s <= 200 * (1 + 1e-12) && commands.tool[1].push_mm_s == commands.tool[2].push_mm_s);
    }
    assert_near(fed[0], 0, 0);
    assert_near(fed[1], 5, 1e-9);

    // three locked tools, and unlocked again
    choose(0);
    lock();
    port[2].push_mm_s = 7;
    commands = hand_set_command(&set, 1);
    for (int k = 0; k < 3; k++)
        assert_command(&commands, k, 7, 0);
    hand_set_answer(&set, &report, 2);
    assert_true(port[0].force_n == 7 && port[1].force_n == 7 && port[2].force_n == 7);
    lock();
    assert_false(hand_grip_pair_is_locked(&set.grip, 3));
    commands = hand_set_command(&set, 1);
    assert_command(&commands, 0, 7, 0);
    assert_command(&commands, 1, 0, 0);
    // a single tool has no partner to lock
    take_hands(1);
    lock();
    assert_true(set.grip.locked == 0 && !hand_grip_pair_is_locked(&set.grip, 1));
}

static void a_tool_that_was_let_go_is_moved_by_no_hand(void **state)
{
    (void)state;
    take_hands(2);
    port[0].push_mm_s = 10;
    let_go();
    port[0].advanced_mm = 1;
    ToolCommands commands = hand_set_command(&set, 1);
    assert_true(commands.released == 1 && commands.tool[0].push_mm_s == 0 && commands.tool[0].twist_deg_s == 0);
    let_go();
    commands = hand_set_command(&set, 1);      // held again: the distance that it moved on its own is discarded
    assert_int_equal(commands.released, 0);
    assert_command(&commands, 0, 10, 0);
    // a lock holds both tools, releasing one unlocks them
    let_go();
    lock();
    assert_true(set.grip.released == 0 && set.grip.locked == 2);
    commands = hand_set_command(&set, 1);
    assert_command(&commands, 1, 10, 0);
    let_go();
    assert_true(set.grip.released == 1 && set.grip.locked == 0);
    // a released tool stays released during a stop
    port[1].buttons = HAND_STOP;
    assert_int_equal(hand_set_command(&set, 1).released, 1);
}

// Buttons of devices act when they go down, not while they are held.
static void buttons_choose_lock_and_let_go(void **state)
{
    (void)state;
    HandGrip grip = {0};
    unsigned before = 0;
    hand_grip_obey(&grip, 3, HAND_CHOOSE_OUTER | HAND_PEDAL, &before);         // there is no tool further out
    assert_int_equal(grip.chosen, 0);
    hand_grip_obey(&grip, 3, HAND_CHOOSE_INNER, &before);
    hand_grip_obey(&grip, 3, HAND_CHOOSE_INNER | HAND_PEDAL, &before);
    assert_int_equal(grip.chosen, 1);
    hand_grip_obey(&grip, 3, 0, &before);
    hand_grip_obey(&grip, 3, HAND_CHOOSE_INNER | HAND_LOCK, &before);          // locks the innermost tool and the one around it
    assert_true(grip.chosen == 2 && grip.locked == 4);
    hand_grip_obey(&grip, 3, HAND_RELEASE, &before);
    assert_true(grip.released == 4 && grip.locked == 0);
    hand_grip_obey(&grip, 3, HAND_RELEASE | HAND_CHOOSE_OUTER, &before);
    assert_true(grip.chosen == 1 && grip.released == 4);
}

// Requesting another device holds the tool and unlocks it; only existing tools and devices are accepted.
static void a_device_is_requested(void **state)
{
    (void)state;
    HandGrip grip = {.chosen = 1, .locked = 6, .released = 1};
    hand_grip_fit(&grip, 3, 1, 2);
    assert_true(grip.fitted[1] == 2 && grip.locked == 0 && grip.released == 1);
    grip.released = 2;
    hand_grip_fit(&grip, 3, 1, 2);      // was requested already
    assert_int_equal(grip.released, 2);
    hand_grip_fit(&grip, 3, 1, 0);
    assert_true(grip.fitted[1] == 0 && grip.released == 0);
    const HandGrip before = grip;
    hand_grip_fit(&grip, 3, 3, 1);
    hand_grip_fit(&grip, 3, -1, 1);
    hand_grip_fit(&grip, 3, 0, EXCHANGES_MOST + 1);
    hand_grip_fit(&grip, 3, 0, -1);
    assert_memory_equal(&grip, &before, sizeof grip);
    hand_set_init(&set, 3);
    hand_grip_fit(&grip, 3, 2, 4);
    hand_set_grip(&set, &grip);
    assert_int_equal(hand_set_command(&set, 1).fitted[2], 4);
}

// Any keys in any order: no tool is both locked and released, and only existing tools are affected.
static void no_grip_contradicts_itself(void **state)
{
    (void)state;
    uint32_t seed = 1;
    for (int tools = 1; tools <= TOOLS_MOST; tools++) {
        HandGrip grip = {0};
        for (int i = 0; i < 2000; i++) {
            seed = seed * 1664525 + 1013904223;
            int what = (int)(seed >> 28);
            if (what < 8)
                hand_grip_choose(&grip, tools, what % 5);
            else if (what < 12)
                hand_grip_lock(&grip, tools);
            else if (what < 14)
                hand_grip_release(&grip);
            else
                hand_grip_fit(&grip, tools, i % tools, i / tools % 3);
            assert_true(grip.chosen >= 0 && grip.chosen < tools && grip.released >> tools == 0 && grip.locked >> tools == 0 && !(grip.locked & 1));
            for (int k = 0; k < tools; k++) {
                bool is_locked = hand_grip_lead(&grip, k) != k || (k + 1 < tools && hand_grip_lead(&grip, k + 1) != k + 1);
                assert_false(is_locked && (grip.released >> k & 1));
            }
        }
    }
}

static void there_is_room_for_so_many_hands(void **state)
{
    (void)state;
    hand_set_init(&set, 2);
    for (int i = 0; i < HANDS_SAMPLED; i++)
        assert_true(hand_set_add(&set, &port[0]));
    assert_false(hand_set_add(&set, &port[1]));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(ways_are_fed_whole_and_no_faster_than_the_limit),
                                       cmocka_unit_test(rates_add_and_stop_holds_all_tools),
                                       cmocka_unit_test(each_hand_moves_its_tool),
                                       cmocka_unit_test(what_is_still_owed_does_not_follow_to_another_tool),
                                       cmocka_unit_test(locked_tools_move_as_one_and_are_felt_together),
                                       cmocka_unit_test(a_tool_that_was_let_go_is_moved_by_no_hand),
                                       cmocka_unit_test(buttons_choose_lock_and_let_go),
                                       cmocka_unit_test(a_device_is_requested),
                                       cmocka_unit_test(no_grip_contradicts_itself),
                                       cmocka_unit_test(there_is_room_for_so_many_hands)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
