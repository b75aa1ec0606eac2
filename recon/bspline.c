typedef int placeholder_bspline;
