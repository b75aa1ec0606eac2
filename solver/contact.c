#include "solver/contact.h"
