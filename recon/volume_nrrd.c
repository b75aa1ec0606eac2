typedef int placeholder_volume_nrrd;
