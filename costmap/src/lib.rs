//! Downwash as parry volumes and as exposure prices.
