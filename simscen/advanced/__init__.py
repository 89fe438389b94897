"""Navigation components that Nav2 does not have, chosen by `stack: {profile: advanced}` or one by one."""
