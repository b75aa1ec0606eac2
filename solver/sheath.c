typedef int placeholder_sheath;
