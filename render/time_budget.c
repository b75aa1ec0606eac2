#include "render/time_budget.h"

#include <math.h>
#include <stdbool.h>

static const double share[] = {1, 0.75, 0.5, 0.375, 0.25};
enum { LEVELS = sizeof share / sizeof share[0], SETTLING = 6, SURE = 30, PATIENCE = 300, LONGEST_PATIENCE = 20000 };

double time_budget_share(const TimeBudget *budget) { return budget->most_ms > 0 ? share[budget->level] : 1; }

static void change(TimeBudget *budget, int level)
{
    budget->level = level;
    budget->pictures = 0;
    budget->mean_ms = 0;
}

void time_budget_spend(TimeBudget *budget, double ms)
{
    const int level = budget->level;
    if (!(budget->most_ms > 0) || !(ms >= 0))
        return;
    // the first pictures at a level also make its layers
    if (budget->pictures++ < SETTLING)
        return;
    int counted = budget->pictures - SETTLING;
    budget->mean_ms += (ms - budget->mean_ms) / fmin(counted, 16);
    const bool fits = level > 0 && budget->mean_ms * pow(share[level - 1] / share[level], 2) < budget->most_ms;
    if (counted >= SETTLING && budget->mean_ms > budget->most_ms && level + 1 < LEVELS) {
        budget->patience = budget->patience > 0 ? (int)fmin(2 * budget->patience, LONGEST_PATIENCE) : PATIENCE;
        change(budget, level + 1);
    } else if (level > 0 && counted >= (fits ? SURE : budget->patience) && budget->mean_ms < 0.9 * budget->most_ms) {
        change(budget, level - 1);
    }
}
