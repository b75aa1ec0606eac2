typedef int placeholder_lim_fit;
