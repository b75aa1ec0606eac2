typedef int placeholder_lim_vessel;
