// The cases of `seldinger check` as JUnit XML, in the form that Jenkins' schema allows (jenkins-junit.xsd of the xUnit plug-in) and GitLab and GitHub's actions
// read: a testsuite for each scene, a testcase for each case; what failed is a failure, what could not be compared an error.
#ifndef SELDINGER_RENDER_CHECK_JUNIT_H
#define SELDINGER_RENDER_CHECK_JUNIT_H

#include "sim/sim.h"

#include <stdio.h>

// UTF-8; characters that XML cannot hold are replaced. Times in seconds with a point.
void check_junit(FILE *out, const CheckLog *log);

#endif
