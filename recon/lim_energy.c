typedef int placeholder_lim_energy;
